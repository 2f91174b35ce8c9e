# Installs the library, moves what was installed, builds the examples with CMake and with pkg-config and
# a plug-in with the static library against it, and runs them; looks at what libraries show, at the man
# pages and the completions, and makes the Debian packages.
# Arguments: BUILD (the build folder), SOURCE (the repository), CONFIG, COMPILER, FLAGS, MPIRUN
# (empty: built without MPI), SHARED, NM, LIBDIR (lib).
cmake_minimum_required(VERSION 3.25)
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

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/first_place)
file(RENAME ${work}/first_place ${work}/installed)
# Nor does it hold a path of this one.
file(GLOB_RECURSE exported ${work}/installed/*/Meniscus*Targets*.cmake
  ${work}/installed/*/meniscus.pc)
if(NOT exported)
  message(FATAL_ERROR "nothing was exported")
endif()
foreach(file ${exported})
  file(STRINGS ${file} paths REGEX "(^|[\":;= ]|-I|-L)/[a-z]")
  if(paths)
    message(FATAL_ERROR "${file} holds a path of this machine: ${paths}")
  endif()
endforeach()

# Nor do the headers name OpenCL's.
file(GLOB headers ${work}/installed/include/meniscus/*.hpp)
if(NOT headers)
  message(FATAL_ERROR "no header was installed")
endif()
foreach(file ${headers})
  file(STRINGS ${file} opencl REGEX "CL/|cl_[a-z]|cl::|CL_")
  if(opencl)
    message(FATAL_ERROR "${file} names OpenCL's: ${opencl}")
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

# What a library shows: `kind` of symbols whose names have `pattern`.
function(symbols file pattern variable)
  execute_process(COMMAND ${NM} -DC --defined-only ${file} OUTPUT_VARIABLE all
    COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE ";" "," all "${all}")
  string(REPLACE "\n" ";" all "${all}")
  list(FILTER all INCLUDE REGEX "${pattern}")
  set(${variable} "${all}" PARENT_SCOPE)
endfunction()

# The plug-in shows nothing of the library that it took in.
symbols(${work}/plugin/libplugin.so "meniscus::|cl::" shown)
if(shown)
  message(FATAL_ERROR "the plug-in shows ${shown}")
endif()

set(pkg_config ${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${work}/installed/${LIBDIR}/pkgconfig
  LD_LIBRARY_PATH=${work}/installed/${LIBDIR})
run(${pkg_config} sh -c "${COMPILER} -std=c++20 ${FLAGS} ${SOURCE}/examples/from_memory.cpp \
  -o by_pkg_config $(pkg-config --cflags --libs meniscus) && ./by_pkg_config")

if(SHARED)
  # The shared library shows what its headers say, and nothing of its own or of others.
  symbols(${work}/installed/${LIBDIR}/libmeniscus.so " [A-Za-z] " all)
  set(strange ${all})
  list(FILTER strange EXCLUDE REGEX " (typeinfo( name)?|vtable) for meniscus::[A-Z][A-Za-z]*$")
  list(FILTER strange EXCLUDE REGEX " [TW] meniscus::(Device::|Session::|ParticleSource::|ParticleArrays::|[a-z_]+(\\[abi:cxx11\\])?\\()")
  if(strange)
    message(FATAL_ERROR "the shared library shows ${strange}")
  endif()
  list(LENGTH all count)
  if(count LESS 40)
    message(FATAL_ERROR "the shared library shows ${count} symbols alone")
  endif()
  file(READ_SYMLINK ${work}/installed/${LIBDIR}/libmeniscus.so link)
  if(NOT link MATCHES "^libmeniscus\\.so\\.[0-9]+\\.[0-9]+$")
    message(FATAL_ERROR "libmeniscus.so leads to ${link}")
  endif()
endif()

# Man pages and completions, where there is a Python to make them.
if(EXISTS ${BUILD}/manual/made)
  file(GLOB pages ${work}/installed/share/man/man1/meniscus*.1)
  list(LENGTH pages count)
  if(count LESS 8)
    message(FATAL_ERROR "${count} man pages")
  endif()
  set(completion ${work}/installed/share/bash-completion/completions/meniscus)
  file(WRITE ${work}/run/complete.sh "compopt() { :; }
. ${completion}
try() { COMP_WORDS=(\"\$@\") COMP_CWORD=\$((\$# - 1)); COMPREPLY=(); _meniscus; echo \"\${COMPREPLY[*]}\"; }
try meniscus ver
try meniscus extract --meth
try meniscus extract --method narrow
try meniscus extract --preview g
try meniscus bench frame --swe
")
  execute_process(COMMAND bash ${work}/run/complete.sh OUTPUT_VARIABLE completed
    COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE "\n" "," completed "${completed}")
  if(NOT completed STREQUAL "verify,--method,narrow-range,groups glass,--sweep,")
    message(FATAL_ERROR "the completions are ${completed}")
  endif()
endif()
if(MPIRUN)
  run(${MPIRUN} --allow-run-as-root --oversubscribe -n 2 ${work}/installed/bin/meniscus
    extract ${SOURCE}/examples/data/cube_drop/frame_007.ply --size 64x48 -o ranks.exr)
endif()
