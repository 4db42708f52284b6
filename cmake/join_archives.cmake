# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# cmake -DAR=<ar> -DARCHIVE=<archive> -DADDED=<archive> -P join_archives.cmake
#
# Puts the members of the second archive into the first.

get_filename_component(folder "${ARCHIVE}" DIRECTORY)
get_filename_component(name "${ARCHIVE}" NAME)
# ar's script language has no quotes, so that it gets names without folders; its own file name may have any.
file(COPY_FILE "${ADDED}" "${folder}/${name}.added.a")
file(WRITE "${folder}/${name}.script" "OPEN ${name}\nADDLIB ${name}.added.a\nSAVE\nEND\n")
execute_process(COMMAND "${AR}" -M
    WORKING_DIRECTORY "${folder}"
    INPUT_FILE "${folder}/${name}.script"
    RESULT_VARIABLE status)
file(REMOVE "${folder}/${name}.added.a" "${folder}/${name}.script")
if(NOT status EQUAL 0)
    message(FATAL_ERROR "${AR} could not put ${ADDED} into ${ARCHIVE}")
endif()
