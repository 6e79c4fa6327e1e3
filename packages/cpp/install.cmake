# Installs libraries, public headers, the files for find_package(hermesh), and the program.
# Components: program, runtime and validation (shared libraries), development.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(rooms hermite voxelizer mesher fracture)
if(HERMESH_BUILD_VALIDATION)
  list(APPEND rooms validation)
endif()
set(libraries)
foreach(room ${rooms})
  target_include_directories(hermesh_public_${room} INTERFACE
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  list(APPEND libraries hermesh_public_${room})
  if(NOT BUILD_SHARED_LIBS)
    set_target_properties(hermesh_${room} PROPERTIES EXPORT_NAME ${room}_archive)
    list(APPEND libraries hermesh_${room})
  endif()
endforeach()
if(BUILD_SHARED_LIBS)
  list(APPEND libraries hermesh_shared)
  if(HERMESH_BUILD_VALIDATION)
    install(TARGETS hermesh_validation_shared EXPORT hermeshTargets
      LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT validation NAMELINK_COMPONENT development)
  endif()
else()
  # Static libraries do not contain their dependencies; the package file finds these on the machine where a
  # program is linked.
  target_link_libraries(hermesh_hermite INTERFACE $<INSTALL_INTERFACE:hermesh::needs>)
  if(HERMESH_BUILD_VALIDATION)
    target_link_libraries(hermesh_validation INTERFACE $<INSTALL_INTERFACE:hermesh::validation_needs>)
  endif()
endif()

install(TARGETS ${libraries} EXPORT hermeshTargets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/hermesh)
install(EXPORT hermeshTargets NAMESPACE hermesh:: DESTINATION ${package_folder} COMPONENT development)
configure_package_config_file(packages/cpp/hermeshConfig.cmake.in
  ${PROJECT_BINARY_DIR}/packages/cpp/hermeshConfig.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/packages/cpp/hermeshConfigVersion.cmake
  COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/packages/cpp/hermeshConfig.cmake
  ${PROJECT_BINARY_DIR}/packages/cpp/hermeshConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT development)
install(DIRECTORY packages/cpp/include/hermesh ${PROJECT_BINARY_DIR}/packages/cpp/include/hermesh
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN "*.h")

if(HERMESH_BUILD_PROGRAM)
  install(TARGETS hermesh hermesh-lab RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
endif()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/hermesh COMPONENT development)

if(HERMESH_DEBIAN_PACKAGES)
  include(packages/debian/packages.cmake)
endif()
