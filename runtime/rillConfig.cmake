# SPDX-License-Identifier: MIT
# find_package(rill [COMPONENTS runtime host]): rill::runtime needs nothing, rill::host needs threads.
foreach(component IN LISTS rill_FIND_COMPONENTS)
  if(component MATCHES "^(runtime|host)$")
    set(rill_${component}_FOUND TRUE)
  elseif(rill_FIND_REQUIRED_${component})
    set(rill_FOUND FALSE)
    set(rill_NOT_FOUND_MESSAGE "rill has no component '${component}': there are runtime and host")
    return()
  endif()
endforeach()
if(NOT rill_FIND_COMPONENTS OR "host" IN_LIST rill_FIND_COMPONENTS)
  include(CMakeFindDependencyMacro)
  find_dependency(Threads)
endif()
include(${CMAKE_CURRENT_LIST_DIR}/rillTargets.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/RillCookAsset.cmake OPTIONAL)  # there when the rill tool is
