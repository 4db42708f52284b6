# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cullet_import_bullet(float|double [<result>])
#
# Makes the imported target bullet::float or bullet::double from the Bullet 2 libraries of that precision, and sets
# <result> to whether it could; without <result> a missing Bullet is an error.
#
# Neither of Bullet's own ways gives both precisions. CMake's FindBullet knows float only. Bullet's BulletConfig.cmake
# has an include folder relative to BULLET_ROOT_DIR, names libraries that Debian does not ship (BulletInverseDynamics),
# and sets plain variables, so that the second precision would overwrite the first. Hence: read the config file for its
# folders and its define inside a function's scope, and look for the three libraries that cullet needs.

include_guard(GLOBAL)

set(CULLET_THREADSAFE_BULLET "" CACHE PATH
    "Prefix of a Bullet in single precision that was built with BT_THREADSAFE (BULLET2_MULTITHREADING); used in place of the system's")

function(cullet_import_bullet precision)
    set(result "${ARGV1}")
    set(problem "")
    if(NOT precision MATCHES "^(float|double)$")
        message(FATAL_ERROR "cullet_import_bullet: float or double expected, not '${precision}'")
    endif()
    if(TARGET bullet::${precision})
        if(result)
            set(${result} TRUE PARENT_SCOPE)
        endif()
        return()
    endif()

    # Debian installs one config file per precision; an upstream build installs one BulletConfig.cmake of either.
    set(configs BulletConfig.cmake)
    if(precision STREQUAL "double")
        set(configs BulletConfig-float64.cmake BulletConfig.cmake)
    endif()
    set(CMAKE_FIND_PACKAGE_PREFER_CONFIG TRUE)
    set(is_threadsafe FALSE)
    if(precision STREQUAL "float" AND CULLET_THREADSAFE_BULLET)
        set(is_threadsafe TRUE)
        set(Bullet_ROOT "${CULLET_THREADSAFE_BULLET}")
    endif()
    find_package(Bullet CONFIG QUIET NAMES Bullet bullet CONFIGS ${configs})
    # The result is cached under one name for both precisions and would be reused with the other file.
    set(config "${Bullet_CONFIG}")
    unset(Bullet_DIR CACHE)
    if(NOT Bullet_FOUND)
        set(problem "no ${configs} found; install libbullet-dev, or set CMAKE_PREFIX_PATH or Bullet_ROOT")
    else()
        set(is_double FALSE)
        if("${BULLET_DEFINITIONS}" MATCHES "BT_USE_DOUBLE_PRECISION")
            set(is_double TRUE)
        endif()
        if(precision STREQUAL "double" AND NOT is_double)
            set(problem "${config} is a float build")
        elseif(precision STREQUAL "float" AND is_double)
            set(problem "${config} is a double build")
        endif()
    endif()

    if(is_threadsafe AND NOT config MATCHES "^${CULLET_THREADSAFE_BULLET}/")
        set(problem "no ${configs} in CULLET_THREADSAFE_BULLET, ${CULLET_THREADSAFE_BULLET}")
    endif()

    if(NOT problem)
        set(suffix "")
        if(config MATCHES "-float64")
            set(suffix "-float64")
        endif()
        # Relative to the root in Bullet's own file, absolute in vcpkg's, lists in Conan's.
        set(include "")
        foreach(folder IN LISTS BULLET_INCLUDE_DIR)
            get_filename_component(folder "${folder}" ABSOLUTE BASE_DIR "${BULLET_ROOT_DIR}")
            if(EXISTS "${folder}/btBulletDynamicsCommon.h")
                set(include "${folder}")
            endif()
        endforeach()
        if(NOT include)
            set(problem "no btBulletDynamicsCommon.h in ${BULLET_INCLUDE_DIR}")
        endif()
        set(libraries "")
        foreach(folder IN LISTS BULLET_LIBRARY_DIRS ITEMS lib)
            get_filename_component(folder "${folder}" ABSOLUTE BASE_DIR "${BULLET_ROOT_DIR}")
            list(APPEND libraries "${folder}")
        endforeach()
        # Two Bullets of one precision must not meet in a process.
        set(elsewhere "")
        if(is_threadsafe)
            set(elsewhere NO_DEFAULT_PATH)
        endif()
        # In link order: each needs those after it.
        set(files "")
        foreach(library BulletDynamics BulletCollision LinearMath)
            find_library(found ${library}${suffix} NAMES ${library}${suffix} ${library}${suffix}_Debug
                HINTS ${libraries} NO_CACHE ${elsewhere})
            if(NOT found)
                set(problem "no library ${library}${suffix} in ${libraries}")
            endif()
            list(APPEND files "${found}")
            unset(found)
        endforeach()
    endif()

    if(problem)
        if(NOT result)
            message(FATAL_ERROR "Bullet, ${precision} precision: ${problem}")
        endif()
        set(${result} FALSE PARENT_SCOPE)
        message(STATUS "Bullet, ${precision} precision: ${problem}")
        return()
    endif()

    add_library(bullet::${precision} INTERFACE IMPORTED GLOBAL)
    # Headers of an imported target are SYSTEM for those who link it: no warnings from Bullet's code.
    set_target_properties(bullet::${precision} PROPERTIES
        INTERFACE_INCLUDE_DIRECTORIES "${include}"
        INTERFACE_LINK_LIBRARIES "${files}")
    if(is_double)
        set_property(TARGET bullet::${precision} PROPERTY INTERFACE_COMPILE_DEFINITIONS BT_USE_DOUBLE_PRECISION)
    endif()
    if(is_threadsafe)
        set_property(TARGET bullet::${precision} APPEND PROPERTY INTERFACE_COMPILE_DEFINITIONS BT_THREADSAFE=1)
    endif()
    if(result)
        set(${result} TRUE PARENT_SCOPE)
    endif()
    message(STATUS "Bullet ${BULLET_VERSION_STRING}, ${precision} precision: ${config}")
endfunction()
