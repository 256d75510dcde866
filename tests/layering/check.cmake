# Includes go down only, third-party headers stay in the folders that are there for them, and what is known in one place is known nowhere else.
set(layer_base 1)
set(layer_scene 2)
set(layer_device 2)
set(layer_image 2)
set(layer_import 3)
set(layer_store 3)
set(layer_wide 3)
set(layer_procedural 3)
set(layer_blocks 4)
set(layer_residency 4)
set(layer_film 4)
set(layer_wavefront 5)
set(layer_render 6)
set(layer_bench 7)
set(layer_cli 8)

# header pattern | files that may include it
set(owners
    "CL/|^src/device/"
    "GL/|^src/import/[^/]*glu"
    "OpenImageIO/|^src/image/[^/]*openimageio"
    "boost/|^src/cli/"
    "nlohmann/|^src/(cli|render)/"
    "xxhash|^src/base/hash"
    "zlib|^src/base/gzip"
    "embree|^NEVER"
    "store/block_file|^src/(store|blocks|bench|cli)/")

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
# The planes and status bits of path slots.
file(GLOB_RECURSE sources RELATIVE ${ROOT} ${ROOT}/src/*.cpp ${ROOT}/src/*.hpp ${ROOT}/include/*.h ${ROOT}/kernels/*.cl ${ROOT}/tests/*.cpp
     ${ROOT}/tests/*.hpp ${ROOT}/tests/*.cl)
foreach(file ${sources})
    file(STRINGS ${ROOT}/${file} found REGEX "RP_(PLANE|STATUS)_[A-Z]" LIMIT_COUNT 1)
    if(found AND NOT file MATCHES "^(include/raypager/abi/path[.]h|kernels/lib/path_state8?[.]cl|src/wavefront/path_state[.][ch]pp|tests/kernel/wake(_stream)?[.]cpp)$")
        list(APPEND errors "${file}: knows planes or status bits of path slots, which only path_state.cl and path_state.cpp do")
    endif()
endforeach()

if(count LESS 20)
    message(FATAL_ERROR "only ${count} files found under ${ROOT}: the check looks in the wrong place")
endif()
if(errors)
    list(JOIN errors "\n  " text)
    message(FATAL_ERROR "layering:\n  ${text}")
endif()
message(STATUS "${count} files, includes go down only")
