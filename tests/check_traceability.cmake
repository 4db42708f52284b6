# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DROOT=<source folder> -P check_traceability.cmake
#
# What docs/traceability.md names in backticks exists: files, test programs, tests and identifiers. And the rows of the
# systems that the lecture and the thesis describe for the broad phase are all there, each with a file and a test.

cmake_minimum_required(VERSION 3.22)

set(wrong "")
set(checked 0)

# All sources of some folders as one text.
function(read_sources variable)
    set(text "")
    foreach(folder IN LISTS ARGN)
        file(GLOB_RECURSE files "${ROOT}/${folder}/*.h" "${ROOT}/${folder}/*.cpp" "${ROOT}/${folder}/*.inl"
            "${ROOT}/${folder}/*.cu" "${ROOT}/${folder}/*.cuh" "${ROOT}/${folder}/*.c" "${ROOT}/${folder}/CMakeLists.txt")
        foreach(file IN LISTS files)
            file(READ "${file}" content)
            string(APPEND text "${content}")
        endforeach()
    endforeach()
    set(${variable} "${text}" PARENT_SCOPE)
endfunction()

read_sources(tests tests)
read_sources(everything broad narrow plugin cuda abi preload demos)
file(READ "${ROOT}/.ci/run" ci)
set(everything "${everything}${tests}${ci}")

# has_word(<variable> <text> <word>): whether the word stands there, not as a part of a longer one
function(has_word variable text word)
    string(REGEX MATCH "(^|[^A-Za-z0-9_])${word}([^A-Za-z0-9_]|$)" found "${text}")
    if(found)
        set(${variable} TRUE PARENT_SCOPE)
    else()
        set(${variable} FALSE PARENT_SCOPE)
    endif()
endfunction()

function(complain message)
    set(wrong "${wrong}\n  ${message}" PARENT_SCOPE)
endfunction()

# A path with or without an ending, or with a star.
macro(check_path token)
    string(REGEX REPLACE "/$" "" path "${token}")
    file(GLOB hits "${ROOT}/${path}" "${ROOT}/${path}.*")
    if(NOT hits)
        complain("${token}: no such file")
    endif()
endmacro()

# A program of tests: its source, or what CMake calls it.
macro(check_test_program token)
    string(REPLACE "*" "[a-z_0-9]*" pattern "${token}")
    has_word(found "${tests}" "${pattern}")
    file(GLOB_RECURSE hits "${ROOT}/tests/${token}.cpp")
    if(NOT found AND NOT hits)
        complain("${token}: no such test program")
    endif()
endmacro()

# Suite.Test, with the prefix and the number of a parameterised one, and stars.
macro(check_test token)
    string(REGEX REPLACE "^([A-Za-z]+/)?([A-Z][A-Za-z0-9]+)(/[0-9*]+)?\\.([A-Za-z0-9*]+)(/.*)?$" "\\2;\\4" parts "${token}")
    list(GET parts 0 suite)
    list(GET parts 1 name)
    string(REPLACE "*" "[A-Za-z0-9]*" name "${name}")
    string(REGEX MATCH "TEST(_[A-Z]+)?\\(${suite},[ \n]*${name}\\)|NAME ${suite}\\.${name}" hit "${tests}")
    if(NOT hit)
        complain("${token}: no such test")
    endif()
endmacro()

# A name of the code, of a file of results, or of a file that lies on top.
macro(check_identifier token)
    file(GLOB hits "${ROOT}/demos/results/*/${token}.csv" "${ROOT}/${token}")
    string(REGEX MATCHALL "[A-Za-z_][A-Za-z0-9_]*" words "${token}")
    foreach(word IN LISTS words)
        string(FIND "${everything}" "${word}" found)
        if(found EQUAL -1 AND NOT hits)
            complain("${token}: ${word} stands in no source")
        endif()
    endforeach()
endmacro()

file(READ "${ROOT}/docs/traceability.md" document)
# What a list of CMake would split or swallow.
string(REPLACE ";" "," document "${document}")
string(REPLACE "[" "(" document "${document}")
string(REPLACE "]" ")" document "${document}")
string(REPLACE "\n" ";" lines "${document}")

set(rows "")
foreach(line IN LISTS lines)
    if(NOT line MATCHES "^\\| ")
        continue()
    endif()
    if(line MATCHES "^\\| ([LT][0-9][^|]*) \\|")
        string(REGEX MATCHALL "[LT][0-9]+" ids "${CMAKE_MATCH_1}")
        list(APPEND rows ${ids})
        # File and test of a broad-phase row: two columns that say something.
        foreach(id IN LISTS ids)
            string(REGEX REPLACE "^[LT]" "" number "${id}")
            if((id MATCHES "^L" AND number GREATER 4) OR (id MATCHES "^T" AND number LESS 17))
                if(NOT line MATCHES "^\\|[^|]+\\|[^|]+\\|[^|]*[a-z][^|]*\\|[^|]*`[^|]*\\|$")
                    complain("${id}: file or test is missing")
                endif()
            endif()
        endforeach()
    endif()
    string(REGEX MATCHALL "`[^`]+`" tokens "${line}")
    foreach(token IN LISTS tokens)
        string(REPLACE "`" "" token "${token}")
        math(EXPR checked "${checked} + 1")
        if(token MATCHES "^(broad|narrow|plugin|cuda|abi|preload|tests|demos|docs|packaging)/[A-Za-z0-9_./*-]+$")
            check_path("${token}")
        elseif(token MATCHES "^test_[a-z_0-9]+\\*?$")
            check_test_program("${token}")
        elseif(token MATCHES "^[A-Za-z]*/?[A-Z][A-Za-z0-9]+(/[0-9*]+)?\\.[A-Z*][A-Za-z0-9*]*(/.*)?$")
            check_test("${token}")
        elseif(token MATCHES "^[A-Za-z_*][A-Za-z0-9_:*()]*$")
            check_identifier("${token}")
        endif()
    endforeach()
endforeach()

foreach(number RANGE 5 24)
    list(APPEND wanted L${number})
endforeach()
foreach(number RANGE 1 16)
    list(APPEND wanted T${number})
endforeach()
foreach(id IN LISTS wanted)
    if(NOT id IN_LIST rows)
        complain("${id}: no row")
    endif()
endforeach()

if(wrong)
    message(FATAL_ERROR "docs/traceability.md names what is not there:${wrong}")
endif()
if(checked LESS 300)
    message(FATAL_ERROR "only ${checked} names found in docs/traceability.md: is it read wrongly?")
endif()
message(STATUS "${checked} names in docs/traceability.md")
