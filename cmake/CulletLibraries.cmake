# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# Joins the parts (cullet_library_part) into the libraries that users link. Nothing is compiled again: the same position
# independent objects, with hidden visibility, make
#
#   libcullet.so, libcullet.a                    everything, for Bullet in float
#   libcullet-float64.so, libcullet-float64.a    everything, for Bullet in double
#   libcullet_broad.a                            the backends over arrays of boxes, without Bullet
#
# Each is complete, so that no user has to know the parts or their order.

include_guard(GLOBAL)

# Before 1.0 a minor version may change the binary interface.
if(PROJECT_VERSION_MAJOR EQUAL 0)
    set(CULLET_SOVERSION "${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
else()
    set(CULLET_SOVERSION "${PROJECT_VERSION_MAJOR}")
endif()
# Hidden visibility does not reach instances of std:: templates, nor the static CUDA runtime; this does.
set(CULLET_SYMBOLS "${PROJECT_BINARY_DIR}/libcullet.map")
configure_file("${PROJECT_SOURCE_DIR}/cmake/libcullet.map.in" "${CULLET_SYMBOLS}" @ONLY)

# cullet_objects_of(<result> <target>...)
function(cullet_objects_of result)
    list(TRANSFORM ARGN REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>")
    set(${result} ${ARGN} PARENT_SCOPE)
endfunction()

# What the joined libraries need to be linked and used; headers first.
function(cullet_link_joined target)
    cullet_library_defaults(${target})
    set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX)
    if(NOT CULLET_INSTALL)
        set_target_properties(${target} PROPERTIES EXCLUDE_FROM_ALL ON)
    endif()
    target_link_libraries(${target} INTERFACE Eigen3::Eigen PRIVATE Threads::Threads)
endfunction()

# An archive brings the static CUDA runtime along, so that whoever links it needs no CUDA.
function(cullet_add_archive target name)
    add_library(${target} STATIC ${ARGN})
    set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name})
    cullet_link_joined(${target})
    if(CULLET_HAS_CUDA)
        target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS} rt)
        add_custom_command(TARGET ${target} POST_BUILD
            COMMAND ${CMAKE_COMMAND} -DAR=${CMAKE_AR} -DARCHIVE=$<TARGET_FILE:${target}>
                    -DADDED=$<TARGET_FILE:CUDA::cudart_static>
                    -P "${PROJECT_SOURCE_DIR}/cmake/join_archives.cmake"
            VERBATIM)
    endif()
endfunction()

function(cullet_add_shared target name)
    add_library(${target} SHARED ${ARGN})
    set_target_properties(${target} PROPERTIES
        OUTPUT_NAME ${name}
        VERSION ${PROJECT_VERSION}
        SOVERSION ${CULLET_SOVERSION}
        LINK_DEPENDS "${CULLET_SYMBOLS}")
    # nodelete: Bullet's dispatchers keep functions of the library when a program closes it.
    # A DLL has a table of what it exports, which CULLET_API writes, and no file of symbols.
    if(NOT WIN32)
        target_link_options(${target} PRIVATE
            "LINKER:--version-script=${CULLET_SYMBOLS},-Bsymbolic-functions,-z,nodelete")
    endif()
    if(NOT CULLET_SANITIZE)
        target_link_options(${target} PRIVATE "LINKER:--no-undefined")
    endif()
    cullet_link_joined(${target})
    if(CULLET_HAS_CUDA)
        target_link_libraries(${target} PRIVATE CUDA::cudart_static)
    endif()
endfunction()

get_property(parts GLOBAL PROPERTY CULLET_PARTS)
get_property(parts_with_bullet GLOBAL PROPERTY CULLET_PARTS_WITH_BULLET)
get_property(paired GLOBAL PROPERTY CULLET_PAIRED_PARTS)
cullet_objects_of(objects ${parts})
cullet_add_archive(cullet_static_broad cullet_broad ${objects})
foreach(scalar IN LISTS CULLET_PRECISIONS)
    cullet_precision_names(${scalar} suffix precision)
    set(members ${paired})
    list(TRANSFORM members APPEND "${suffix}")
    cullet_objects_of(objects ${parts} ${parts_with_bullet} ${members})
    cullet_add_archive(cullet_static${suffix} cullet${suffix} ${objects})
    cullet_add_shared(cullet_shared${suffix} cullet${suffix} ${objects})
    foreach(linkage static shared)
        target_link_libraries(cullet_${linkage}${suffix} PUBLIC bullet::${scalar})
    endforeach()
    # For a project that adds cullet as a subdirectory, the names that find_package(cullet) gives.
    if(BUILD_SHARED_LIBS)
        add_library(cullet::plugin${suffix} ALIAS cullet_shared${suffix})
    else()
        add_library(cullet::plugin${suffix} ALIAS cullet_plugin${suffix})
    endif()
endforeach()
