# embed_files(TARGET PREFIX FILES...) makes a static library TARGET whose header <build>/PREFIX.h gives, for each file
# `a/b.cl`, the bytes as `PREFIX_b_cl[]` with a terminating zero and their count as `PREFIX_b_cl_length`, and all of them in
# order as `PREFIX_files[]` of {name, text, length}, ended by a NULL name.
set(EMBED_SCRIPT ${CMAKE_CURRENT_LIST_DIR}/embed_file.cmake)

function(embed_files target prefix)
  set(header ${PROJECT_BINARY_DIR}/${prefix}.h)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${prefix}.c)
  set(paths)
  foreach(file ${ARGN})
    list(APPEND paths ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  endforeach()
  add_custom_command(OUTPUT ${source} ${header}
    COMMAND ${CMAKE_COMMAND} -D "FILES=${paths}" -D PREFIX=${prefix} -D HEADER=${header} -D SOURCE=${source} -P ${EMBED_SCRIPT}
    DEPENDS ${paths} ${EMBED_SCRIPT} VERBATIM)
  add_library(${target} STATIC ${source} ${header})
  target_include_directories(${target} PUBLIC ${PROJECT_BINARY_DIR})
endfunction()
