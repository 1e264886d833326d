# Fills FOLDER with what SCN compiles of SCENES: its cache is sent there. Where that is not possible (no OpenCL device on the machine that builds) the stock
# stays empty, and scenes are compiled when they are rendered.
file(REMOVE_RECURSE ${FOLDER} ${WORK}/pocl)
get_filename_component(share ${FOLDER} DIRECTORY)
set(ENV{XDG_CACHE_HOME} ${share})
set(ENV{POCL_CACHE_DIR} ${WORK}/pocl)
file(MAKE_DIRECTORY ${FOLDER} ${WORK}/pocl)
foreach(scene ${SCENES})
  execute_process(COMMAND ${SCN} build ${scene} -o ${WORK}/stock.scnk -q --device cpu
    RESULT_VARIABLE status ERROR_VARIABLE why OUTPUT_QUIET)
  if(NOT status EQUAL 0)
    message(STATUS "the stock of kernels has none for ${scene}: ${why}")
  endif()
endforeach()
file(REMOVE_RECURSE ${WORK}/pocl ${WORK}/stock.scnk)
