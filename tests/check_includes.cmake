# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DROOT=<source folder> -P check_includes.cmake
#
# Holds the arrows between the folders: preload, abi -> plugin; plugin -> broad, narrow, mid, cuda; mid -> narrow; cuda -> broad;
# all -> base; broad, narrow and mid know neither Bullet nor CUDA, and broad and narrow not each other. And those between the
# rooms of a folder, see room(). An include in quotes is spelled as after install and names the folder, so that a reader sees
# the arrow.

cmake_minimum_required(VERSION 3.22)

set(bullet "<(bt[A-Z][A-Za-z0-9]*\\.h|bullet/|BulletCollision|BulletDynamics|BulletSoftBody|LinearMath)")
set(cuda "<(cuda|cub/|thrust/|curand|nv/|nvtx|device_launch|cooperative_groups|math_constants)")
set(kernels "<(cub|thrust)/")
set(eigen "<(Eigen|unsupported/Eigen)/")
set(test_only "<(gtest|gmock)/")
set(found "")
set(file_count 0)

# check_folder(<folder> MAY <folder>... NEVER <regex>...)
function(check_folder folder)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "MAY;NEVER")
    string(REPLACE ";" "|" may "${arg_MAY}")
    string(REPLACE ";" "|" never "${arg_NEVER}")
    file(GLOB_RECURSE files RELATIVE "${ROOT}"
        "${ROOT}/${folder}/*.h" "${ROOT}/${folder}/*.cpp" "${ROOT}/${folder}/*.inl"
        "${ROOT}/${folder}/*.cu" "${ROOT}/${folder}/*.cuh")
    foreach(file IN LISTS files)
        if(file MATCHES "^(tests/consumer|preload/demonstration)/")
            # A user's code, with a user's includes.
            continue()
        endif()
        math(EXPR file_count "${file_count} + 1")
        file(STRINGS "${ROOT}/${file}" lines REGEX "^[ \t]*#[ \t]*include")
        foreach(line IN LISTS lines)
            string(REGEX REPLACE "^[ \t]*#[ \t]*include[ \t]*" "" include "${line}")
            string(REGEX REPLACE "^(<[^>]*>|\"[^\"]*\").*$" "\\1" include "${include}")
            if(include MATCHES "^\"" AND NOT include MATCHES "^\"cullet/(${may})/")
                list(APPEND found "${file}: ${include}")
            elseif(include MATCHES "^<cullet/")
                list(APPEND found "${file}: ${include} (in quotes inside)")
            elseif(never AND include MATCHES "^(${never})")
                list(APPEND found "${file}: ${include}")
            endif()
        endforeach()
    endforeach()
    set(found "${found}" PARENT_SCOPE)
    set(file_count ${file_count} PARENT_SCOPE)
endfunction()

check_folder(base MAY base NEVER "${bullet}" "${cuda}" "${eigen}" "${test_only}")
check_folder(broad MAY base broad NEVER "${bullet}" "${cuda}" "${eigen}" "${test_only}")
# A source file that nvcc never sees may solve its eigenvalue problem with Eigen.
list(FILTER found EXCLUDE REGEX "^broad/psap/thesis/principal_axis\\.cpp: <Eigen/")
check_folder(narrow MAY base narrow NEVER "${bullet}" "${cuda}" "${test_only}")
check_folder(mid MAY base narrow mid NEVER "${bullet}" "${cuda}" "${test_only}")
check_folder(cuda MAY base cuda broad NEVER "${bullet}" "${eigen}" "${test_only}")
check_folder(plugin MAY base plugin broad narrow mid cuda NEVER "${cuda}" "${test_only}")
check_folder(preload MAY preload plugin NEVER "${cuda}" "${test_only}")
check_folder(abi MAY base abi plugin broad narrow cuda NEVER "${cuda}" "${test_only}")
check_folder(demos MAY base demos generated plugin broad narrow mid cuda NEVER "${kernels}" "${test_only}")
check_folder(tests MAY base tests demos generated abi plugin broad narrow mid cuda)

# room(<folder> MAY <folder>...): what the files of a folder, without those below it, may include besides each other.
function(room folder)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "MAY")
    set(rooms ${rooms} ${folder} PARENT_SCOPE)
    set(may_${folder} ${folder} ${arg_MAY} PARENT_SCOPE)
endfunction()

set(rooms "")
room(base)
room(base/threads MAY base)
room(base/trees MAY base base/threads)
room(broad MAY base broad/boxes)
room(broad/boxes MAY base broad)
room(broad/recording MAY broad)
room(broad/pairs MAY base base/threads broad broad/boxes)
room(broad/queries MAY base base/trees broad broad/boxes)
room(broad/grid/columns MAY base base/threads broad broad/boxes)
room(broad/grid/kernels MAY base broad broad/boxes broad/grid/columns)
room(broad/small MAY base broad broad/boxes broad/pairs broad/grid/columns)
room(broad/grid/moving MAY base broad broad/boxes broad/pairs broad/grid/columns)
room(broad/grid/resting MAY base broad broad/boxes broad/pairs broad/grid/columns)
room(broad/grid MAY base base/threads broad broad/boxes broad/pairs broad/small broad/grid/columns broad/grid/moving
    broad/grid/resting)
room(broad/comparison MAY base broad broad/boxes broad/pairs)
room(broad/psap/data MAY broad)
room(broad/psap/exec MAY base base/threads broad broad/psap/data)
room(broad/psap/sorted MAY broad broad/psap/data broad/psap/exec)
room(broad/psap/thesis MAY broad broad/psap/data)
room(broad/psap/tiles MAY broad broad/psap/data)
room(broad/psap/update MAY base base/threads broad broad/boxes broad/psap/data)
room(broad/psap/verlet MAY broad broad/psap/data broad/psap/exec broad/psap/update)
room(broad/psap MAY base broad broad/pairs broad/psap/data broad/psap/exec broad/psap/sorted broad/psap/thesis broad/psap/tiles
    broad/psap/update broad/psap/verlet)
room(narrow/math MAY base)
room(narrow/box MAY base)
room(narrow/hull MAY base narrow/math)
room(narrow/build MAY base narrow/hull narrow/math)
room(narrow/gjk MAY base narrow/hull narrow/math)
room(narrow/epa MAY base narrow/gjk narrow/hull narrow/math)
room(mid MAY base base/threads base/trees narrow/box)
room(cuda/runtime MAY broad broad/psap/exec)
room(cuda/kernels MAY broad broad/psap/data broad/psap/exec broad/psap/tiles cuda/runtime)
room(cuda MAY base broad broad/psap cuda/kernels cuda/runtime)
room(plugin/core MAY broad)
room(plugin/pair_cache MAY base broad plugin/core)
room(plugin/proxies MAY base broad broad/queries plugin/core)
room(plugin/pair_sync MAY base base/threads broad broad/boxes broad/queries plugin/core plugin/pair_cache plugin/proxies)
room(plugin/shapes MAY base narrow/math narrow/hull narrow/build narrow/gjk plugin/core)
room(plugin/contact MAY base narrow/math narrow/box narrow/hull plugin/core plugin/shapes)
room(plugin/convex MAY base base/threads broad mid narrow/math narrow/box narrow/hull narrow/gjk narrow/epa plugin/core plugin/shapes plugin/contact)
room(plugin/mesh MAY mid narrow/math narrow/hull narrow/gjk plugin/core plugin/shapes plugin/contact plugin/convex)
room(plugin/queries MAY base base/threads mid plugin/core)
room(plugin/step MAY broad plugin/core)
room(plugin/solver MAY base base/threads plugin/core plugin/step)
room(plugin MAY base base/threads broad broad/queries cuda plugin/core plugin/pair_cache plugin/proxies plugin/pair_sync plugin/shapes
    plugin/contact plugin/convex plugin/mesh plugin/queries plugin/solver plugin/step)

# Against those arrows still: parts of one class in several rooms, and options in the header that users include.
set(back_edges
    "broad/grid/grid_backend.cpp broad/comparison/cell_grid_backend.h"
    "broad/grid/moving/[a-z_]+.cpp broad/grid/column_grid_backend.h"
    "broad/grid/resting/[a-z_]+.cpp broad/grid/column_grid_backend.h"
    "broad/psap/update/upload_steps.h broad/psap/verlet/neighbour_steps.h"
    "plugin/(convex|mesh)/[a-z_]+.(h|cpp) plugin/isa_gjk.h"
    "plugin/pair_sync/(backend_choice|pair_sync).h plugin/broadphase.h"
    "plugin/shapes/hull_cache.h plugin/isa_gjk.h")
string(REPLACE "." "[.]" back_edges "${back_edges}")

set(used_edges "")
foreach(folder base broad narrow mid cuda plugin)
    file(GLOB_RECURSE files RELATIVE "${ROOT}" "${ROOT}/${folder}/*.h" "${ROOT}/${folder}/*.cpp" "${ROOT}/${folder}/*.inl"
        "${ROOT}/${folder}/*.cu" "${ROOT}/${folder}/*.cuh")
    foreach(file IN LISTS files)
        get_filename_component(own "${file}" DIRECTORY)
        if(NOT own IN_LIST rooms)
            list(APPEND found "${file}: no room()")
            continue()
        endif()
        file(STRINGS "${ROOT}/${file}" includes REGEX "^[ \t]*#[ \t]*include[ \t]*\"cullet/")
        list(TRANSFORM includes REPLACE "^[^\"]*\"cullet/([^\"]*)\".*$" "\\1")
        foreach(include IN LISTS includes)
            get_filename_component(other "${include}" DIRECTORY)
            if(other IN_LIST may_${own})
                continue()
            endif()
            set(is_known FALSE)
            foreach(edge IN LISTS back_edges)
                if("${file} ${include}" MATCHES "^${edge}$")
                    set(is_known TRUE)
                    list(APPEND used_edges "${edge}")
                endif()
            endforeach()
            if(NOT is_known)
                list(APPEND found "${file}: ${include}")
            endif()
        endforeach()
    endforeach()
endforeach()
foreach(edge IN LISTS back_edges)
    if(NOT edge IN_LIST used_edges)
        list(APPEND found "${edge}: no such include any more, take it from the list")
    endif()
endforeach()

# check_stands(<what> <regex> <regex of the files in which it may stand>): device code and assembler, in as few files as can be.
function(check_stands what regex may)
    foreach(folder base broad narrow mid cuda plugin abi preload)
        file(GLOB_RECURSE files RELATIVE "${ROOT}" "${ROOT}/${folder}/*.h" "${ROOT}/${folder}/*.cpp" "${ROOT}/${folder}/*.inl"
            "${ROOT}/${folder}/*.cu" "${ROOT}/${folder}/*.cuh")
        list(FILTER files EXCLUDE REGEX "^(${may})$")
        foreach(file IN LISTS files)
            file(STRINGS "${ROOT}/${file}" lines REGEX "${regex}")
            if(lines)
                list(APPEND found "${file}: ${what} (in listed files only)")
            endif()
        endforeach()
    endforeach()
    set(found "${found}" PARENT_SCOPE)
endfunction()
set(psap_device "bins|counting_sort|device_boxes|pair_lists|records|scene_statistics")
set(kernel_device "launch|multi_list_kernels|step_kernels|tile_kernels")
check_stands("__CUDA_ARCH__" "__CUDA_ARCH__"
    "broad/host_device[.]h|broad/psap/data/(${psap_device})[.]h|broad/psap/sorted/warp_scratch[.]h|cuda/kernels/(${kernel_device})[.]cuh")
set(psap_asm "data/counting_sort|exec/shared_memory|sorted/warp_scratch")
set(kernel_asm "block_append|launch|tile_kernels|warp_scan")
set(host_asm "narrow/gjk/gjk_search[.]h|narrow/hull/posed_hull[.]h|plugin/core/dynamic_type[.]h|preload/interpose(_dynamics)?[.]cpp")
check_stands("asm" "(^|[^A-Za-z0-9_])asm( volatile)?\\("
    "broad/psap/(${psap_asm})[.]h|cuda/kernels/(${kernel_asm})[.]cuh|${host_asm}")

# Only nvcc finds cub and thrust in every toolkit: CUDA 13 moved them where a host compiler does not look.
file(GLOB_RECURSE files RELATIVE "${ROOT}" "${ROOT}/cuda/*.h" "${ROOT}/cuda/*.cpp")
foreach(file IN LISTS files)
    file(STRINGS "${ROOT}/${file}" lines REGEX "^[ \t]*#[ \t]*include[ \t]*${kernels}")
    if(lines)
        list(APPEND found "${file}: ${lines} (in a file for the host compiler)")
    endif()
endforeach()

if(file_count EQUAL 0)
    message(FATAL_ERROR "no sources found in ${ROOT}")
endif()
if(found)
    string(REPLACE ";" "\n  " found "${found}")
    message(FATAL_ERROR "includes against the arrows of docs/design.md:\n  ${found}")
endif()
message(STATUS "${file_count} files: all includes follow the arrows")
