# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DROOT=<source folder> -P check_includes.cmake
#
# Holds the arrows between the folders: preload, abi -> plugin; plugin -> broad, narrow, cuda; cuda -> broad; broad and
# narrow know neither Bullet nor CUDA nor each other. An include in quotes is spelled as after install and names
# the folder, so that a reader sees the arrow.

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

check_folder(broad MAY broad NEVER "${bullet}" "${cuda}" "${eigen}" "${test_only}")
# A source file that nvcc never sees may solve its eigenvalue problem with Eigen.
list(FILTER found EXCLUDE REGEX "^broad/psap_principal\\.cpp: <Eigen/")
check_folder(narrow MAY narrow NEVER "${bullet}" "${cuda}" "${test_only}")
check_folder(cuda MAY cuda broad NEVER "${bullet}" "${eigen}" "${test_only}")
check_folder(plugin MAY plugin broad narrow cuda NEVER "${cuda}" "${test_only}")
check_folder(preload MAY preload plugin NEVER "${cuda}" "${test_only}")
check_folder(abi MAY abi plugin broad narrow cuda NEVER "${cuda}" "${test_only}")
check_folder(demos MAY demos generated plugin broad narrow cuda NEVER "${kernels}" "${test_only}")
check_folder(tests MAY tests demos abi plugin broad narrow cuda)

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
