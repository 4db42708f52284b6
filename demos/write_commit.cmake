# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DSOURCE=<folder> -DOUTPUT=<header> -P write_commit.cmake
#
# Runs in every build; touches the header only when the commit changed.

set(commit "unknown")
find_package(Git QUIET)
if(GIT_FOUND)
    execute_process(COMMAND ${GIT_EXECUTABLE} rev-parse HEAD WORKING_DIRECTORY ${SOURCE}
        OUTPUT_VARIABLE head RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(NOT failed)
        set(commit "${head}")
        execute_process(COMMAND ${GIT_EXECUTABLE} diff --quiet HEAD WORKING_DIRECTORY ${SOURCE}
            RESULT_VARIABLE differs ERROR_QUIET)
        if(differs)
            string(APPEND commit "-dirty")
        endif()
    endif()
endif()
set(text "#pragma once\n#define CULLET_COMMIT \"${commit}\"\n")
set(old "")
if(EXISTS "${OUTPUT}")
    file(READ "${OUTPUT}" old)
endif()
if(NOT text STREQUAL old)
    file(WRITE "${OUTPUT}" "${text}")
endif()
