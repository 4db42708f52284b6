# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# A Bullet that is compiled together with cullet, as engines bundle it, in place of an installed one:
#
#   CULLET_BULLET_TARGETS   targets of the project, e.g. BulletDynamics;BulletCollision;LinearMath after
#                           add_subdirectory(bullet3), which decide the precision, too
#   CULLET_BULLET_SOURCE    a folder of Bullet's sources (which has src/btBulletDynamicsCommon.h): cullet compiles them, in each of
#                           CULLET_PRECISIONS; beside CULLET_BULLET_TARGETS only the headers are taken from there
#
# cullet_bundle_bullet() makes bullet::float and bullet::double of either, and sets CULLET_BUNDLED_BULLET to whether it has.
# What sees Bullet's headers has to be compiled with the macros of Bullet's own sources (BT_THREADSAFE, BT_USE_SSE and others):
# those of targets are read from them, those of CULLET_BULLET_SOURCE are in CULLET_BULLET_DEFINITIONS.

include_guard(GLOBAL)

set(CULLET_BULLET_TARGETS "" CACHE STRING "Targets of this project that are Bullet, in link order, in place of an installed one")
set(CULLET_BULLET_SOURCE "" CACHE PATH "Folder of Bullet's sources to compile, in place of an installed Bullet")
set(CULLET_BULLET_DEFINITIONS "" CACHE STRING "Macros for the Bullet of CULLET_BULLET_SOURCE, e.g. BT_THREADSAFE=1")

# cullet_bullet_headers(<result> <folder>...): the first folder, or src in one, that has Bullet's headers.
function(cullet_bullet_headers result)
    foreach(folder IN LISTS ARGN)
        foreach(candidate "${folder}" "${folder}/src")
            if(EXISTS "${candidate}/btBulletDynamicsCommon.h")
                get_filename_component(candidate "${candidate}" ABSOLUTE)
                set(${result} "${candidate}" PARENT_SCOPE)
                return()
            endif()
        endforeach()
    endforeach()
    message(FATAL_ERROR "no btBulletDynamicsCommon.h in ${ARGN}: CULLET_BULLET_SOURCE has to be the folder of Bullet's sources")
endfunction()

# cullet_compile_bullet(float|double <folder of headers>): the targets cullet_bullet_<library>, with -float64 in double precision.
function(cullet_compile_bullet scalar headers)
    cullet_precision_names(${scalar} suffix precision)
    set(definitions ${CULLET_BULLET_DEFINITIONS})
    if(scalar STREQUAL "double")
        list(APPEND definitions BT_USE_DOUBLE_PRECISION)
    endif()
    # Each library after those that it needs.
    set(needed Threads::Threads)
    foreach(library LinearMath BulletCollision BulletDynamics BulletSoftBody)
        file(GLOB_RECURSE sources "${headers}/${library}/*.cpp")
        if(NOT sources)
            message(FATAL_ERROR "no sources of ${library} in ${headers}")
        endif()
        set(target cullet_bullet_${library}${suffix})
        add_library(${target} STATIC EXCLUDE_FROM_ALL ${sources})
        target_include_directories(${target} SYSTEM PUBLIC "${headers}")
        target_compile_definitions(${target} PUBLIC ${definitions})
        target_compile_options(${target} PRIVATE -w)
        # Headers of soft bodies may be read once only.
        if(NOT library STREQUAL "BulletSoftBody")
            set_property(TARGET ${target} PROPERTY UNITY_BUILD "${CULLET_UNITY}")
        endif()
        target_link_libraries(${target} PUBLIC ${needed})
        set(needed ${target})
    endforeach()
endfunction()

# cullet_macros_of(<result> <target>...): Bullet's macros that targets of Bullet are compiled with.
function(cullet_macros_of result)
    set(macros "")
    foreach(target IN LISTS ARGN)
        if(NOT TARGET ${target})
            message(FATAL_ERROR "CULLET_BULLET_TARGETS: there is no target ${target}; add Bullet before cullet")
        endif()
        get_target_property(folder ${target} SOURCE_DIR)
        get_property(of_folder DIRECTORY "${folder}" PROPERTY COMPILE_DEFINITIONS)
        get_property(own TARGET ${target} PROPERTY COMPILE_DEFINITIONS)
        get_property(public TARGET ${target} PROPERTY INTERFACE_COMPILE_DEFINITIONS)
        list(APPEND macros ${of_folder} ${own} ${public})
    endforeach()
    list(TRANSFORM macros REPLACE "^-D" "")
    list(FILTER macros INCLUDE REGEX "^BT_")
    list(REMOVE_DUPLICATES macros)
    set(${result} "${macros}" PARENT_SCOPE)
endfunction()

# cullet_import_bundled_bullet(float|double <folder of headers> <target>...)
function(cullet_import_bundled_bullet scalar headers)
    foreach(target IN LISTS ARGN)
        get_target_property(type ${target} TYPE)
        if(type STREQUAL "STATIC_LIBRARY" AND BUILD_SHARED_LIBS)
            message(FATAL_ERROR "${target} is static: cullet as a shared library would have a Bullet of its own, with other "
                "globals than the program's; set BUILD_SHARED_LIBS to OFF")
        endif()
    endforeach()
    cullet_macros_of(macros ${ARGN})
    add_library(bullet::${scalar} INTERFACE IMPORTED GLOBAL)
    # Not set_target_properties(), which Debian's sources of Bullet replace by a function that takes lists apart.
    set_property(TARGET bullet::${scalar} PROPERTY INTERFACE_INCLUDE_DIRECTORIES "${headers}")
    set_property(TARGET bullet::${scalar} PROPERTY INTERFACE_COMPILE_DEFINITIONS "${macros}")
    set_property(TARGET bullet::${scalar} PROPERTY INTERFACE_LINK_LIBRARIES "${ARGN}")
    file(STRINGS "${headers}/LinearMath/btScalar.h" version REGEX "#define BT_BULLET_VERSION [0-9]+")
    string(REGEX MATCH "[0-9]+$" version "${version}")
    message(STATUS "Bullet ${version}, ${scalar} precision, bundled: ${headers}; macros: ${macros}")
endfunction()

# A macro, since it sets variables of the project.
macro(cullet_bundle_bullet)
    set(CULLET_BUNDLED_BULLET FALSE)
    if(CULLET_BULLET_TARGETS)
        set(CULLET_BUNDLED_BULLET TRUE)
        # One precision, whatever the cache says: both have the same symbols.
        set(CULLET_PRECISIONS float)
        cullet_macros_of(cullet_macros ${CULLET_BULLET_TARGETS})
        if("BT_USE_DOUBLE_PRECISION" IN_LIST cullet_macros)
            set(CULLET_PRECISIONS double)
        endif()
        list(GET CULLET_BULLET_TARGETS 0 cullet_target)
        get_target_property(cullet_folder ${cullet_target} SOURCE_DIR)
        cullet_bullet_headers(cullet_folder ${CULLET_BULLET_SOURCE} "${cullet_folder}" "${cullet_folder}/..")
        cullet_import_bundled_bullet(${CULLET_PRECISIONS} "${cullet_folder}" ${CULLET_BULLET_TARGETS})
    elseif(CULLET_BULLET_SOURCE)
        set(CULLET_BUNDLED_BULLET TRUE)
        cullet_bullet_headers(cullet_folder "${CULLET_BULLET_SOURCE}")
        foreach(scalar IN LISTS CULLET_PRECISIONS)
            cullet_compile_bullet(${scalar} "${cullet_folder}")
            cullet_precision_names(${scalar} suffix precision)
            cullet_import_bundled_bullet(${scalar} "${cullet_folder}" cullet_bullet_BulletDynamics${suffix})
        endforeach()
    endif()
    if(CULLET_BUNDLED_BULLET)
        # An installed cullet would look for an installed Bullet, which need not have the same layouts.
        set(CULLET_INSTALL OFF)
        # A program has to have Bullet as a library that can be taken the place of.
        set(CULLET_PRELOAD OFF)
    endif()
endmacro()
