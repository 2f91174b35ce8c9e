# Installs the library, builds the examples and a plug-in against the installed package, and runs them.
# Arguments: BUILD (the build folder), SOURCE (the repository), CONFIG, COMPILER, FLAGS, MPIRUN
# (empty: built without MPI).
set(work ${BUILD}/package_test)
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work}/run)

function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${work}/run COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# A package is for other machines: it holds no code for the processor of this one.
if(EXISTS ${BUILD}/compile_commands.json)
  file(STRINGS ${BUILD}/compile_commands.json native REGEX "-march=native")
  if(native)
    message(FATAL_ERROR "configure with -DMENISCUS_NATIVE_BENCHMARKS=OFF: ${native}")
  endif()
endif()

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/installed)
# Nor does it hold a path of this one.
file(GLOB_RECURSE exported ${work}/installed/*/MeniscusTargets*.cmake)
foreach(file ${exported})
  file(STRINGS ${file} paths REGEX "[\":;]/[a-z]")
  if(paths)
    message(FATAL_ERROR "${file} holds a path of this machine: ${paths}")
  endif()
endforeach()

function(build source folder)
  run(${CMAKE_COMMAND} -S ${SOURCE}/${source} -B ${work}/${folder} -G Ninja
    -DCMAKE_PREFIX_PATH=${work}/installed -DCMAKE_BUILD_TYPE=${CONFIG}
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS})
  run(${CMAKE_COMMAND} --build ${work}/${folder})
endfunction()

build(examples build)
run(${work}/build/extract_surface ${SOURCE}/examples/data/cube_drop/frame_007.ply)
run(${work}/build/from_memory)
foreach(file surface.png surface.ply ball.exr)
  if(NOT EXISTS ${work}/run/${file})
    message(FATAL_ERROR "the examples did not write ${file}")
  endif()
endforeach()
build(tests/package/plugin plugin)
run(${work}/plugin/host)
run(${work}/installed/bin/meniscus --version)
if(MPIRUN)
  run(${MPIRUN} -q --allow-run-as-root --oversubscribe -n 2 ${work}/installed/bin/meniscus
    extract ${SOURCE}/examples/data/cube_drop/frame_007.ply --size 64x48 -o ranks.exr)
endif()
