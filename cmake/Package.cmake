# Debian packages: `cpack --config build/CPackConfig.cmake -B build/packages` makes raypager, the program, and libraypager-dev, the library with its
# headers. What they depend on dpkg-shlibdeps finds in the program; it is part of the package dpkg-dev.
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/raypager RENAME copyright COMPONENT program)
install(FILES ${CMAKE_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/raypager COMPONENT program)
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libraypager-dev RENAME copyright COMPONENT development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME raypager)
set(CPACK_PACKAGE_CONTACT "raypager maintainers")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CHECKSUM SHA256)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)

set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "raypager path-traces scenes many times larger than the memory of the
device, on GPUs and, with pocl-opencl-icd, on CPUs.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME raypager)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
# Any OpenCL driver will do.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")

set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "The static library of raypager with its headers, for CMake and pkg-config.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libraypager-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "ocl-icd-opencl-dev, libfmt-dev, zlib1g-dev, libopenimageio-dev, libimath-dev, libglu1-mesa-dev")
include(CPack)
