# What `cmake --install` installs: the program, and the library with its headers, for find_package(raypager) and pkg-config.
include(CMakePackageConfigHelpers)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/raypager)
install(TARGETS raypager RUNTIME COMPONENT program)
install(TARGETS raypager_engine EXPORT raypager COMPONENT development)
if(RAYPAGER_EDGES)
    install(TARGETS raypager_openimageio EXPORT raypager COMPONENT development)
endif()
install(DIRECTORY ${CMAKE_SOURCE_DIR}/include/raypager DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(EXPORT raypager NAMESPACE raypager:: DESTINATION ${package} FILE raypager-targets.cmake
    COMPONENT development)

configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/raypager-config.cmake.in ${CMAKE_BINARY_DIR}/raypager-config.cmake
    INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/raypager-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/raypager-config.cmake ${CMAKE_BINARY_DIR}/raypager-config-version.cmake DESTINATION ${package}
    COMPONENT development)

# A static library: whoever links it links what it uses.
set(gltf_libraries "")
foreach(library DRACO MESHOPT)
    if(RAYPAGER_${library} AND RAYPAGER_${library}_INCLUDE)
        string(APPEND gltf_libraries " ${RAYPAGER_${library}}")
    endif()
endforeach()
set(fmt_library $<IF:$<BOOL:${RAYPAGER_STATIC}>,,-lfmt>)
# Wherever it is installed, the rest lies where it does from there.
file(RELATIVE_PATH to_include /${CMAKE_INSTALL_LIBDIR}/pkgconfig /${CMAKE_INSTALL_INCLUDEDIR})
file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/raypager.pc CONTENT "libdir=\${pcfiledir}/..
includedir=\${pcfiledir}/${to_include}

Name: raypager
Description: ${PROJECT_DESCRIPTION}
Version: ${PROJECT_VERSION}
Libs: -L\${libdir} -lraypager ${RAYPAGER_GLU}${gltf_libraries} -lz ${fmt_library} -lOpenCL -ldl -pthread
Cflags: -I\${includedir}
")
install(FILES ${CMAKE_BINARY_DIR}/raypager.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
