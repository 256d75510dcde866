# How the folders of src/ become libraries. One static library a folder group: the engine needs OpenCL and the standard library alone
# (and fmt and zlib; xxHash, nlohmann-json and tinygltf are header-only here; of GLU the tessellator alone, statically; where they are installed, Draco
# and meshoptimizer); the edges bring OpenImageIO.

macro(raypager_find_dependencies)
    set(THREADS_PREFER_PTHREAD_FLAG ON)
    find_package(Threads REQUIRED)
    find_package(OpenCL REQUIRED)
    find_package(fmt REQUIRED)
    find_package(nlohmann_json REQUIRED)
    if(RAYPAGER_STATIC)
        set(Boost_USE_STATIC_LIBS ON)
        set(ZLIB_USE_STATIC_LIBS ON)
    endif()
    find_package(ZLIB REQUIRED)
    find_package(Boost REQUIRED COMPONENTS program_options)
    if(RAYPAGER_EDGES)
        # Not Debian's CMake package of OpenImageIO: it insists on its command-line tools and on OpenCV's headers.
        find_library(RAYPAGER_OPENIMAGEIO OpenImageIO REQUIRED)
        find_library(RAYPAGER_OPENIMAGEIO_UTIL OpenImageIO_Util REQUIRED)
        find_path(RAYPAGER_OPENIMAGEIO_INCLUDE OpenImageIO/imageio.h REQUIRED)
        find_package(Imath REQUIRED)
    endif()
    # Its tessellator alone, which needs no OpenGL: from the static library where there is one, so that nothing else comes along.
    find_library(RAYPAGER_GLU NAMES libGLU.a GLU REQUIRED)
    find_path(RAYPAGER_GLU_INCLUDE GL/glu.h REQUIRED)
    # All of its code is in its header, which src/import/gltf_tiny.cpp compiles.
    find_path(RAYPAGER_TINYGLTF_INCLUDE tiny_gltf.h REQUIRED)
    # What packs meshes of glTF. Files that need one that is not here are refused.
    find_path(RAYPAGER_DRACO_INCLUDE draco/compression/decode.h)
    find_path(RAYPAGER_MESHOPT_INCLUDE meshoptimizer.h)
    if(RAYPAGER_STATIC)
        find_library(RAYPAGER_DRACO libdraco.a)
        find_library(RAYPAGER_MESHOPT libmeshoptimizer.a)
    else()
        find_library(RAYPAGER_DRACO draco)
        find_library(RAYPAGER_MESHOPT meshoptimizer)
    endif()
    foreach(library DRACO MESHOPT)
        if(NOT RAYPAGER_${library} OR NOT RAYPAGER_${library}_INCLUDE)
            message(STATUS "glTF files that need ${library} will be refused: there is no such library")
        endif()
    endforeach()
endmacro()

add_library(raypager_options INTERFACE)
target_compile_options(raypager_options INTERFACE -Wall -Wextra -Werror)
if(NOT RAYPAGER_UNITY)
    target_compile_options(raypager_options INTERFACE -Wshadow)  # else by names of another source
endif()
# One rounding per operation, as on the devices: host code that kernels are compared with must not fuse.
target_compile_options(raypager_options INTERFACE -ffp-contract=off)
if(RAYPAGER_SANITIZE)
    target_compile_options(raypager_options INTERFACE -fsanitize=${RAYPAGER_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
    target_link_options(raypager_options INTERFACE -fsanitize=${RAYPAGER_SANITIZE})
endif()

# kernels/ and the abi headers travel inside the program, so that it needs no files beside it.
function(raypager_embed_kernels)
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/kernels/*/*.cl ${CMAKE_SOURCE_DIR}/include/raypager/abi/*.h)
    raypager_embed(RAYPAGER_KERNEL_SOURCES kernel_sources device/kernel_sources.hpp KernelSource ${sources})
    set(RAYPAGER_KERNEL_SOURCES ${RAYPAGER_KERNEL_SOURCES} PARENT_SCOPE)
endfunction()

# Makes a C++ file that defines the function, which the header declares, to return these sources as that type. Its path comes into the variable.
function(raypager_embed variable function header type)
    string(REGEX REPLACE ".*::" "" name ${function})
    set(output ${CMAKE_BINARY_DIR}/generated/${name}.cpp)
    add_custom_command(
        OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DFUNCTION=${function} -DHEADER=${header} -DTYPE=${type} "-DSOURCES=${ARGN}" -DROOT=${CMAKE_SOURCE_DIR}
            -P ${CMAKE_SOURCE_DIR}/cmake/EmbedKernels.cmake
        DEPENDS ${ARGN} ${CMAKE_SOURCE_DIR}/cmake/EmbedKernels.cmake
        VERBATIM)
    set(${variable} ${output} PARENT_SCOPE)
endfunction()

# All sources of a folder are one, so that their names either go together or do not, whatever else there is. Unit tests are many:
# there it is all whose names begin with the same word, the folder of src/ that they test.
function(raypager_unity target)
    get_target_property(sources ${target} SOURCES)
    foreach(source ${sources})
        cmake_path(GET source PARENT_PATH folder)
        cmake_path(GET folder FILENAME group)
        if(group STREQUAL "unit")
            cmake_path(GET source STEM name)
            string(REGEX MATCH "^[^_]+" group ${name})
        endif()
        set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group})
    endforeach()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ${RAYPAGER_UNITY} UNITY_BUILD_MODE GROUP)
endfunction()

# Into programs and into modules that are loaded, such as Python's, alike. With hidden names that costs programs nothing: calls stay direct.
function(raypager_goes_into_modules target)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
endfunction()

function(raypager_libraries)
    set(engine "")
    foreach(folder base scene image denoise device block lights store texture procedural import world clouds cut gather pack bake residency film wavefront render bench)
        file(GLOB found CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/${folder}/*.cpp)
        list(APPEND engine ${found})
    endforeach()
    # What needs the libraries of the edges lies in files of that name.
    list(FILTER engine EXCLUDE REGEX "openimageio[^/]*\\.cpp$")
    add_library(raypager_engine STATIC ${engine} ${RAYPAGER_KERNEL_SOURCES})
    target_include_directories(raypager_engine PUBLIC $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/include> $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/src>
        $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_compile_features(raypager_engine PUBLIC cxx_std_20)
    set_target_properties(raypager_engine PROPERTIES OUTPUT_NAME raypager EXPORT_NAME raypager)
    raypager_goes_into_modules(raypager_engine)
    # What only the engine and the tests, which look into it, compile with, users of the library do not see.
    add_library(raypager_inside INTERFACE)
    target_compile_definitions(raypager_inside INTERFACE CL_TARGET_OPENCL_VERSION=120 CL_HPP_TARGET_OPENCL_VERSION=120
        CL_HPP_MINIMUM_OPENCL_VERSION=120 RAYPAGER_VERSION="${PROJECT_VERSION}" $<$<BOOL:${RAYPAGER_EDGES}>:RAYPAGER_EDGES=1>)
    target_link_libraries(raypager_inside INTERFACE raypager_options nlohmann_json::nlohmann_json)
    target_link_libraries(raypager_engine PUBLIC $<BUILD_INTERFACE:raypager_inside> PRIVATE OpenCL::OpenCL Threads::Threads ZLIB::ZLIB ${RAYPAGER_GLU} ${CMAKE_DL_LIBS})
    target_include_directories(raypager_engine SYSTEM PRIVATE ${RAYPAGER_GLU_INCLUDE} ${RAYPAGER_TINYGLTF_INCLUDE})
    foreach(library DRACO MESHOPT)
        if(RAYPAGER_${library} AND RAYPAGER_${library}_INCLUDE)
            # For its own source alone: others need not be compiled anew where the library comes or goes.
            string(TOLOWER ${library} name)
            set_source_files_properties(${CMAKE_SOURCE_DIR}/src/import/gltf_${name}.cpp PROPERTIES COMPILE_DEFINITIONS RAYPAGER_${library}=1)
            target_include_directories(raypager_engine SYSTEM PRIVATE ${RAYPAGER_${library}_INCLUDE})
            target_link_libraries(raypager_engine PRIVATE ${RAYPAGER_${library}})
        endif()
    endforeach()
    # Compiled with each source that uses it, fmt takes more of the time than most sources. Debian has no static library of it.
    if(RAYPAGER_STATIC)
        target_compile_definitions(raypager_inside INTERFACE FMT_HEADER_ONLY)
    else()
        target_link_libraries(raypager_engine PRIVATE fmt::fmt)
        target_link_libraries(raypager_inside INTERFACE fmt::fmt)
    endif()
    raypager_unity(raypager_engine)
    # Thousands of lines that others need not share a name with.
    set_source_files_properties(${CMAKE_SOURCE_DIR}/src/import/gltf_tiny.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON SKIP_PRECOMPILE_HEADERS ON)
    target_precompile_headers(raypager_engine PRIVATE <algorithm> <string> <vector> <memory> <functional> <filesystem> <fmt/format.h>)
    # The headers of these libraries do not stand up to our warnings.
    if(RAYPAGER_EDGES)
        # OpenImageIO is for programs that read and write pictures: it takes a quarter of a second to load.
        file(GLOB openimageio CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/*/*openimageio*.cpp)
        add_library(raypager_openimageio STATIC ${openimageio})
        set_target_properties(raypager_openimageio PROPERTIES EXPORT_NAME openimageio)
        raypager_goes_into_modules(raypager_openimageio)
        target_compile_definitions(raypager_openimageio INTERFACE RAYPAGER_OPENIMAGEIO=1)
        target_include_directories(raypager_openimageio SYSTEM PRIVATE ${RAYPAGER_OPENIMAGEIO_INCLUDE})
        target_link_libraries(raypager_openimageio PUBLIC raypager_engine PRIVATE ${RAYPAGER_OPENIMAGEIO} ${RAYPAGER_OPENIMAGEIO_UTIL} Imath::Imath)
    else()
        add_library(raypager_openimageio INTERFACE)
    endif()
endfunction()

function(raypager_program)
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/cli/*.cpp)
    list(FILTER sources EXCLUDE REGEX "main\\.cpp$")
    add_library(raypager_cli STATIC ${sources})
    raypager_unity(raypager_cli)
    raypager_goes_into_modules(raypager_cli)
    target_link_libraries(raypager_cli PUBLIC raypager_engine Boost::program_options)
    if(RAYPAGER_VIEW)
        raypager_live_view()
        target_compile_definitions(raypager_cli PRIVATE RAYPAGER_VIEW=1)
        target_link_libraries(raypager_cli PUBLIC raypager_view)
    endif()
    if(RAYPAGER_MPI)
        raypager_cluster()
        target_compile_definitions(raypager_cli PRIVATE RAYPAGER_MPI=1)
        target_link_libraries(raypager_cli PUBLIC raypager_cluster)
    endif()
    if(RAYPAGER_SANITIZE)
        target_compile_options(raypager_cli PRIVATE -O0)  # optimising it takes a minute and a half then, for code that runs once
    endif()
    add_executable(raypager ${CMAKE_SOURCE_DIR}/src/cli/main.cpp)
    target_link_libraries(raypager PRIVATE raypager_cli raypager_openimageio)
    if(RAYPAGER_STATIC)
        target_link_options(raypager PRIVATE -static-libstdc++ -static-libgcc)
    endif()
endfunction()

# Processes that share a render: a library of its own, for MPI is loaded with it.
function(raypager_cluster)
    find_package(MPI REQUIRED COMPONENTS CXX)
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/cluster/*.cpp)
    add_library(raypager_cluster STATIC ${sources})
    raypager_goes_into_modules(raypager_cluster)
    target_link_libraries(raypager_cluster PUBLIC raypager_engine PRIVATE MPI::MPI_CXX)
    target_compile_definitions(raypager_cluster PRIVATE OMPI_SKIP_MPICXX MPICH_SKIP_MPICXX)  # of MPI's C++ bindings, which it no longer has
endfunction()

# The live view: a web server for a page that lies inside the program. Boost.Beast is headers alone; they come with Boost's others.
function(raypager_live_view)
    find_path(RAYPAGER_BEAST_INCLUDE boost/beast/http.hpp HINTS ${Boost_INCLUDE_DIRS} REQUIRED)
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/view/*.cpp)
    file(GLOB page CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/view/page/*)
    raypager_embed(page_sources page_files view/page_files.hpp PageFile ${page})
    add_library(raypager_view STATIC ${sources} ${page_sources})
    raypager_unity(raypager_view)
    # Its thousands of lines of headers need be read with no other source.
    set_source_files_properties(${CMAKE_SOURCE_DIR}/src/view/http_server.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    raypager_goes_into_modules(raypager_view)
    target_include_directories(raypager_view SYSTEM PRIVATE ${RAYPAGER_BEAST_INCLUDE})
    target_link_libraries(raypager_view PUBLIC raypager_engine PRIVATE Threads::Threads)
    if(RAYPAGER_SANITIZE)
        target_compile_options(raypager_view PRIVATE -O0)
    endif()
endfunction()

# The Python package's compiled part. What is Python in it, scikit-build-core takes from src/python/raypager (pyproject.toml).
function(raypager_python)
    find_package(Python 3.11 REQUIRED COMPONENTS Interpreter Development.Module OPTIONAL_COMPONENTS Development.SABIModule)
    execute_process(COMMAND ${Python_EXECUTABLE} -m nanobind --cmake_dir OUTPUT_STRIP_TRAILING_WHITESPACE OUTPUT_VARIABLE found ERROR_QUIET)
    find_package(nanobind CONFIG REQUIRED PATHS "${found}")
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/python/*.cpp)
    nanobind_add_module(_raypager STABLE_ABI NB_STATIC NB_SUPPRESS_WARNINGS ${sources})
    raypager_unity(_raypager)
    target_link_libraries(_raypager PRIVATE raypager_openimageio raypager_cli raypager_engine)
    nanobind_add_stub(_raypager_stub MODULE _raypager OUTPUT _raypager.pyi PYTHON_PATH $<TARGET_FILE_DIR:_raypager> DEPENDS _raypager)
    # For wheels alone: an installed program has no use for it.
    install(TARGETS _raypager LIBRARY DESTINATION raypager COMPONENT python EXCLUDE_FROM_ALL)
    install(FILES ${CMAKE_CURRENT_BINARY_DIR}/_raypager.pyi DESTINATION raypager COMPONENT python EXCLUDE_FROM_ALL)
endfunction()
