# SPDX-License-Identifier: MIT
# Builds and runs the consumer: way=installed (against a prefix made from rill_build) or way=inside.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE ${work})
if(way STREQUAL "installed")
  execute_process(COMMAND ${CMAKE_COMMAND} --install ${rill_build} --prefix ${work}/prefix --component library
    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  set(where -DCMAKE_PREFIX_PATH=${work}/prefix -DRILL_VERSION=${version})
else()
  set(where -DRILL_SOURCE=${rill_source})
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -G ${generator} -S ${CMAKE_CURRENT_LIST_DIR} -B ${work}/build
  -DCMAKE_CXX_COMPILER=${compiler} -DCMAKE_CXX_FLAGS=${flags} -DCMAKE_BUILD_TYPE=Release ${where}
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${work}/build --target consumer COMMAND_ERROR_IS_FATAL ANY)

# Runs the consumer on a file; its line must match.
function(expect file pattern)
  execute_process(COMMAND ${work}/build/consumer ${file} OUTPUT_VARIABLE said COMMAND_ERROR_IS_FATAL ANY)
  message(STATUS "${file}: ${said}")
  if(NOT said MATCHES "${pattern}")
    message(FATAL_ERROR "expected ${pattern}")
  endif()
endfunction()

string(REPEAT "not an asset " 100 damaged)
file(WRITE ${work}/damaged.rill "${damaged}")
expect(${work}/damaged.rill "^status -[0-9]+: .+; 0 frames")
foreach(asset ${golden})
  expect(${asset} "^status 0: .+; [1-9][0-9]* frames")
endforeach()
