# Sets hermesh_python_is_built from HERMESH_BUILD_PYTHON and the installed packages; prints the reason if it
# is off.
set(hermesh_python_is_built OFF)
if(NOT PROJECT_IS_TOP_LEVEL OR (NOT HERMESH_BUILD_PYTHON STREQUAL "AUTO" AND NOT HERMESH_BUILD_PYTHON))
  return()
endif()
set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH
  "Python that the module hermesh is built for: the distribution's")
set(missing)
if(HERMESH_SANITIZE)
  set(missing "a build without sanitizers, which Python does not load")
else()
  # pybind11 takes the headers' folder on trust, and the module's tests and examples want the rest.
  execute_process(COMMAND ${PYTHON_EXECUTABLE} -c
    "import numpy, os, sysconfig, venv, ensurepip; os.stat(os.path.join(sysconfig.get_path('include'), 'Python.h'))"
    RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET)
  if(NOT failed)
    find_package(pybind11 2.10 QUIET CONFIG)
  endif()
  if(failed OR NOT pybind11_FOUND)
    set(missing "pybind11, numpy and Python's headers and virtual environments (Debian: pybind11-dev python3-dev python3-numpy python3-venv)")
  endif()
endif()
if(NOT missing)
  message(STATUS "Python module: built for ${PYTHON_EXECUTABLE}")
  set(hermesh_python_is_built ON)
elseif(HERMESH_BUILD_PYTHON STREQUAL "AUTO")
  message(STATUS "Python module: not built; it needs ${missing}")
else()
  message(FATAL_ERROR "HERMESH_BUILD_PYTHON needs ${missing}")
endif()
