# Debian packages by CPack, from one build with BUILD_SHARED_LIBS: packages/make_packages.sh does it all.
#   hermesh                  the program
#   libhermesh1              libhermesh.so.1, Apache-2.0
#   libhermesh-validation1   libhermesh_validation.so.1, GPL-3
#   libhermesh-dev           headers and package files
#   python3-hermesh          the Python module, where it is built
if(NOT HERMESH_DEBIAN_MAINTAINER)
  set(HERMESH_DEBIAN_MAINTAINER "The hermesh project <hermesh@example.org>")
endif()
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME hermesh)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${HERMESH_DEBIAN_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY >=)
# Where the libraries of one package lie while those of another are looked for.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/packages/cpp)

# hermesh_package(COMPONENT NAME SECTION SUMMARY TEXT): what a component's package is called and says of
# itself, with its copyright and changelog.
set(hermesh_components)
macro(hermesh_package component name section summary text)
  list(APPEND hermesh_components ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}\n${text}")
  install(FILES ${PROJECT_SOURCE_DIR}/packages/debian/copyright
    ${PROJECT_BINARY_DIR}/packages/changelog.Debian.gz
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component})
endmacro()
# The time within a compressed file would make each build's another.
execute_process(COMMAND gzip -9nc ${PROJECT_SOURCE_DIR}/packages/debian/changelog
  OUTPUT_FILE ${PROJECT_BINARY_DIR}/packages/changelog.Debian.gz COMMAND_ERROR_IS_FATAL ANY)

set(what
"Narrow bands of exact distances from any soup of polygons, adaptive dual
contouring free of self-intersection, Boolean operations on Hermite data and
fracture, on the sparse volumes of OpenVDB.")
set(same "(= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
hermesh_package(program hermesh graphics "polygons to sparse volumes and back" "${what}
This package holds the program, which also judges meshes: topology,
self-intersections and certified distances.")
hermesh_package(runtime libhermesh1 libs "polygons to sparse volumes and back - shared library" "${what}
This package holds the shared library.")
hermesh_package(development libhermesh-dev libdevel "polygons to sparse volumes and back - development files" "${what}
This package holds the headers, which include the C++ standard library
alone, and the files by which find_package(hermesh) of CMake finds all.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libhermesh1 ${same}")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS libopenvdb-dev)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS python3-numpy)  # for hermesh-check-certificate
if(HERMESH_BUILD_VALIDATION)
  hermesh_package(validation libhermesh-validation1 libs
    "polygons to sparse volumes and back - judges of meshes"
"Topology, self-intersections, certified Hausdorff distances, comparison of
solids, and whether the pieces of a fracture fit. This package holds the
shared library, which is under GPL-3.")
  set(CPACK_DEBIAN_VALIDATION_PACKAGE_DEPENDS "libhermesh1 ${same}")
  string(APPEND CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS ", libhermesh-validation1 ${same}")
endif()
# The machine's list of libraries is brought up to date once for all packages.
foreach(component RUNTIME VALIDATION)
  set(CPACK_DEBIAN_${component}_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packages/debian/triggers)
endforeach()
if(TARGET hermesh_python)
  hermesh_package(python python3-hermesh python "polygons to sparse volumes and back - Python module" "${what}
This package holds the Python module, with volumes and meshes as numpy arrays.")
  # Extension modules are for the version of Python that they are built for.
  execute_process(COMMAND ${PYTHON_EXECUTABLE} -c
    "import sys; print(*sys.version_info[:2]); print(sys.version_info[1] + 1)"
    OUTPUT_VARIABLE python_version COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[0-9]+" python_version "${python_version}")
  list(GET python_version 0 major)
  list(GET python_version 1 minor)
  list(GET python_version 2 next)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= ${major}.${minor}), python3 (<< ${major}.${next}), python3-numpy, libhermesh1 ${same}")
  if(HERMESH_BUILD_VALIDATION)
    string(APPEND CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS ", libhermesh-validation1 ${same}")
  endif()
endif()
set(CPACK_COMPONENTS_ALL ${hermesh_components})
include(CPack)
