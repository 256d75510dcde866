# Includes go down only, third-party headers stay in the folders that are there for them, and what is known in one place is known nowhere else.
set(layer_base 1)
set(layer_scene 2)
set(layer_device 2)
set(layer_image 2)
set(layer_denoise 2)
set(layer_import 3)
set(layer_procedural 3)
set(layer_block 3)
set(layer_lights 3)
set(layer_store 4)
set(layer_texture 4)
set(layer_world 4)
set(layer_film 4)
set(layer_clouds 5)
set(layer_cut 5)
set(layer_residency 5)
set(layer_gather 6)
set(layer_pack 6)
set(layer_wavefront 6)
set(layer_bake 7)
set(layer_render 7)
set(layer_bench 8)
set(layer_cluster 8)
set(layer_view 9)
set(layer_cli 10)
set(layer_python 11)

# header pattern | files that may include it
set(owners
    "CL/|^src/device/"
    "dlfcn|^src/denoise/"
    "GL/|^src/import/[^/]*glu"
    "OpenImageIO/|^src/image/[^/]*openimageio"
    "boost/asio/|^src/view/http_server"
    "boost/beast/|^src/view/http_server"
    "boost/program_options|^src/cli/"
    "boost/|^src/(cli|view)/"
    "mpi[.]h|^src/cluster/"
    "nanobind/|^src/python/"
    "Python[.]h|^NEVER"
    "nlohmann/|^src/(cli/|view/|render/|import/gltf_json)"
    "tiny_gltf|^src/import/gltf_tiny"
    "draco/|^src/import/gltf_draco"
    "meshoptimizer|^src/import/gltf_meshopt"
    "xxhash|^src/base/hash"
    "zlib|^src/(base/gzip|image/ptex_file)"
    "embree|^NEVER"
    "store/block_file|^src/(store|bake|bench|cli)/")

file(GLOB_RECURSE files RELATIVE ${ROOT} ${ROOT}/src/*.cpp ${ROOT}/src/*.hpp ${ROOT}/include/*.hpp ${ROOT}/include/*.h)
set(count 0)
set(errors "")
foreach(file ${files})
    math(EXPR count "${count} + 1")
    file(STRINGS ${ROOT}/${file} includes REGEX "^ *# *include")
    set(from "")
    if(file MATCHES "^src/([a-z]+)/")
        set(from ${CMAKE_MATCH_1})
        if(NOT DEFINED layer_${from})
            list(APPEND errors "${file}: the folder has no layer; add it to tests/layering/check.cmake")
        endif()
    endif()
    foreach(line ${includes})
        string(REGEX REPLACE ".*[<\"]([^>\"]+)[>\"].*" "\\1" name "${line}")
        set(to "")
        if(line MATCHES "\"" AND name MATCHES "^([a-z]+)/")
            set(to ${CMAKE_MATCH_1})
        endif()
        # In an if of its own: names in a condition are put in before any of it is looked at.
        if(DEFINED layer_${to})
            if(from STREQUAL "")
                list(APPEND errors "${file}: a public header includes ${name}")
            elseif(NOT from STREQUAL to AND NOT layer_${to} LESS layer_${from})
                list(APPEND errors "${file}: includes ${name}, which is not below it")
            endif()
        endif()
        foreach(owner ${owners})
            string(REGEX MATCH "^([^|]*)\\|(.*)$" unused "${owner}")
            set(pattern ${CMAKE_MATCH_1})
            set(allowed ${CMAKE_MATCH_2})
            if(name MATCHES "^${pattern}" AND NOT file MATCHES "${allowed}")
                list(APPEND errors "${file}: includes ${name}, which belongs to ${allowed}")
            endif()
        endforeach()
    endforeach()
endforeach()
# What users of the command line, of the live view and of Python see is made of the public library alone, and of what stands beside it.
function(uses_public_library_alone file allowed)
    file(STRINGS ${ROOT}/${file} includes REGEX "^ *# *include +\"")
    foreach(line ${includes})
        if(NOT line MATCHES "\"(raypager|base)/|${allowed}")
            list(APPEND errors "${file}: ${line} is not in the public library")
        endif()
    endforeach()
    set(errors ${errors} PARENT_SCOPE)
endfunction()
foreach(file ${files})
    # Measurements, and what looks into block files, know more.
    if(file MATCHES "^src/cli/" AND NOT file MATCHES "^src/cli/(bench|sweep_state|traverse_options|inspect|make_scene)")
        uses_public_library_alone(${file} "\"(cli|view|cluster)/|\"scene/(vector|box)[.]hpp\"")
    elseif(file MATCHES "^src/view/")
        uses_public_library_alone(${file} "\"view/")
    elseif(file STREQUAL "src/python/program.cpp")
        uses_public_library_alone(${file} "\"python/|\"cli/program[.]hpp")
    elseif(file MATCHES "^src/python/")
        uses_public_library_alone(${file} "\"python/")
    endif()
endforeach()
# The planes and status bits of path slots.
file(GLOB_RECURSE sources RELATIVE ${ROOT} ${ROOT}/src/*.cpp ${ROOT}/src/*.hpp ${ROOT}/include/*.h ${ROOT}/kernels/*.cl ${ROOT}/tests/*.cpp
     ${ROOT}/tests/*.hpp ${ROOT}/tests/*.cl)
foreach(file ${sources})
    file(STRINGS ${ROOT}/${file} found REGEX "RP_(PLANE|STATUS)_[A-Z]" LIMIT_COUNT 1)
    if(found AND NOT file MATCHES "^(include/raypager/abi/path[.]h|kernels/(common|stream)/path_state8?[.]cl|kernels/common/path_(runs|arrival)[.]cl|src/wavefront/path_state[.][ch]pp|tests/kernel/wake(_stream)?[.]cpp|tests/support/texture_probe[.]cpp)$")
        list(APPEND errors "${file}: knows planes or status bits of path slots, which only path_state.cl and path_state.cpp do")
    endif()
endforeach()

# What fails on purpose is of tests alone: it is handed to the program from outside, which does not know of it.
file(GLOB_RECURSE sources RELATIVE ${ROOT} ${ROOT}/src/*.cpp ${ROOT}/src/*.hpp ${ROOT}/include/*.hpp)
foreach(file ${sources})
    file(STRINGS ${ROOT}/${file} found REGEX "[Ff]ault_?[Pp]lan|[Dd]evice_?[Ff]aults|inject_|[Ff]ailing_?(Device|File)|ScopedFileSystem|\"support/" LIMIT_COUNT 1)
    if(found AND NOT file MATCHES "^src/base/file_system[.][ch]pp$")
        list(APPEND errors "${file}: knows of faults on purpose, or puts a file system in place, which only tests do: ${found}")
    endif()
endforeach()

# What the host defines for kernels, kernels know: a name that only one side changed would leave code out in silence.
file(GLOB_RECURSE sources ${ROOT}/kernels/*.cl ${ROOT}/include/raypager/abi/*.h)
set(known "")
foreach(file ${sources})
    file(READ ${file} text)
    string(APPEND known "${text}")
endforeach()
file(GLOB_RECURSE sources RELATIVE ${ROOT} ${ROOT}/src/*.cpp ${ROOT}/src/*.hpp)
foreach(file ${sources})
    file(READ ${ROOT}/${file} text)
    string(REGEX MATCHALL "-DRP_[A-Z0-9_]+" definitions "${text}")
    foreach(definition ${definitions})
        string(SUBSTRING ${definition} 2 -1 name)
        if(NOT known MATCHES "[^A-Z0-9_]${name}[^A-Z0-9_]")
            list(APPEND errors "${file}: defines ${name}, which no kernel knows")
        endif()
    endforeach()
endforeach()
# Kernels: what both ways of tracing use lies below them, and neither knows the other.
set(kernels_common "common")
set(kernels_shading "common|shading")
set(kernels_single_ray "common|shading|single_ray")
set(kernels_stream "common|shading|stream")
file(GLOB_RECURSE sources RELATIVE ${ROOT} ${ROOT}/kernels/*.cl)
foreach(file ${sources})
    string(REGEX REPLACE "^kernels/([a-z_]+)/.*" "\\1" from ${file})
    file(STRINGS ${ROOT}/${file} includes REGEX "^ *# *include")
    foreach(line ${includes})
        if(NOT line MATCHES "\"(raypager/abi|${kernels_${from}})/")
            list(APPEND errors "${file}: ${line} is not below it")
        endif()
    endforeach()
endforeach()

if(count LESS 20)
    message(FATAL_ERROR "only ${count} files found under ${ROOT}: the check looks in the wrong place")
endif()
if(errors)
    list(JOIN errors "\n  " text)
    message(FATAL_ERROR "layering:\n  ${text}")
endif()
message(STATUS "${count} files, includes go down only")
