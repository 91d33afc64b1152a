# SPDX-License-Identifier: MIT
# cmake -D source= -P house_rules.cmake
# What the design promises about the source itself: a licence line everywhere, and dependencies that point one way.
cmake_minimum_required(VERSION 3.25)

# Every line of every file under `folders` that matches `pattern` breaks `rule`.
function(forbid rule pattern)
  foreach(folder ${ARGN})
    file(GLOB_RECURSE files ${source}/${folder}/*.h ${source}/${folder}/*.cpp)
    foreach(file ${files})
      file(STRINGS ${file} lines REGEX "${pattern}")
      foreach(line IN LISTS lines)
        message(SEND_ERROR "${file}: ${rule}: ${line}")
      endforeach()
    endforeach()
  endforeach()
endfunction()

set(folders content cooker runtime sample_app tests third_party)
foreach(folder ${folders})
  foreach(kind *.h *.cpp *.cmake *.sh *.py CMakeLists.txt)
    file(GLOB_RECURSE files ${source}/${folder}/${kind})
    foreach(file ${files})
      file(STRINGS ${file} head LIMIT_COUNT 2)
      if(NOT head MATCHES "SPDX-License-Identifier: MIT")
        message(SEND_ERROR "${file}: no licence line on top")
      endif()
    endforeach()
  endforeach()
endforeach()

forbid("the runtime knows the standard library and GLM only"
  "^#include <([^>]*/|[^>]*\\.h)" runtime/include)
forbid("the runtime knows the standard library and GLM only"
  "^#include (\"[^\"]*cooker|<(Eigen|nlohmann|nanoflann|zlib|draco|meshopt|CLI)|<iostream>)" runtime)
forbid("only the runtime itself includes its src/" "^#include \"(runtime/)?src/" cooker sample_app)
forbid("a game sees rill/*.h only" "^#include \"(format|surface|cooker)/" sample_app)

# Stages know what comes before them, never what comes after.
set(stages common measure readers writers frames asset tracks verify cook rivals commands)
set(later ${stages})
foreach(stage ${stages})
  list(REMOVE_ITEM later ${stage})
  if(later)
    string(JOIN "|" names ${later})
    forbid("${stage}/ comes before" "^#include \"(${names})/" cooker/${stage})
  endif()
endforeach()
