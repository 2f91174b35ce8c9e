# Installs the library, builds the example against the installed package, and runs it.
# Arguments: BUILD (the build folder), SOURCE (the repository), CONFIG, COMPILER, FLAGS, MPIRUN
# (empty: built without MPI).
set(work ${BUILD}/package_test)
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work}/run)

function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${work}/run COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/installed)
run(${CMAKE_COMMAND} -S ${SOURCE}/examples -B ${work}/build -G Ninja
  -DCMAKE_PREFIX_PATH=${work}/installed -DCMAKE_BUILD_TYPE=${CONFIG}
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${work}/build)
run(${work}/build/extract_surface ${SOURCE}/examples/data/cube_drop/frame_007.ply)
foreach(file surface.png surface.ply)
  if(NOT EXISTS ${work}/run/${file})
    message(FATAL_ERROR "the example did not write ${file}")
  endif()
endforeach()
run(${work}/installed/bin/meniscus --version)
if(MPIRUN)
  run(${MPIRUN} -q --allow-run-as-root --oversubscribe -n 2 ${work}/installed/bin/meniscus
    extract ${SOURCE}/examples/data/cube_drop/frame_007.ply --size 64x48 -o ranks.exr)
endif()
