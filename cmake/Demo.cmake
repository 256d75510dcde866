# The target "demo": a procedural landscape, rendered with a fifth of its geometry resident on the default device.
# Included by the build it declares the target; run as a script (cmake -P) it is the demo itself.

if(NOT CMAKE_SCRIPT_MODE_FILE)
    add_custom_target(demo
        COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:raypager> -DEDGES=${RAYPAGER_EDGES} -DFOLDER=${CMAKE_BINARY_DIR}/demo
                -P ${CMAKE_SOURCE_DIR}/cmake/Demo.cmake
        DEPENDS raypager
        USES_TERMINAL  # progress is shown as it comes
        VERBATIM)
    return()
endif()

# Small blocks, because the scene is small: the pool then holds some dozens of them, as it would with a large scene and large blocks.
set(triangles 2.5M)
set(block_size 256K)
set(limit 20%)
set(size 960x540)
set(spp 64)
set(picture terrain.pfm)
if(EDGES)
    set(picture terrain.png)
endif()

function(run)
    list(JOIN ARGN " " words)
    message("\n$ raypager ${words}")
    execute_process(COMMAND ${PROGRAM} ${ARGN} WORKING_DIRECTORY ${FOLDER} RESULT_VARIABLE status)
    if(NOT status EQUAL 0)
        message(FATAL_ERROR "the demo failed: raypager ${words}")
    endif()
endfunction()

file(MAKE_DIRECTORY ${FOLDER})
run(devices)
run(make-scene terrain -o terrain --triangles ${triangles})
run(bake terrain/scene.pbrt -o terrain.rpb --block-size ${block_size})
run(inspect terrain.rpb)
run(render terrain.rpb -o ${picture} --geometry-limit ${limit} --size ${size} --spp ${spp} --report report.json)

file(READ ${FOLDER}/report.json report)
string(JSON geometry GET ${report} scene geometry_bytes)
string(JSON limit_bytes GET ${report} limits geometry_bytes)
string(JSON loaded GET ${report} paging bytes_loaded)
# Rounded to a tenth, as in the summary of the render above.
function(quotient result numerator denominator)
    math(EXPR tenths "(10 * ${numerator} + ${denominator} / 2) / ${denominator}")
    math(EXPR whole "${tenths} / 10")
    math(EXPR tenth "${tenths} % 10")
    set(${result} ${whole}.${tenth} PARENT_SCOPE)
endfunction()
math(EXPR hundredfold "100 * ${limit_bytes}")
quotient(share ${hundredfold} ${geometry})
quotient(times ${loaded} ${geometry})
message("
At most ${share} % of the geometry was on the device at any time; the whole scene went through it ${times} times.
  picture     ${FOLDER}/${picture}
  figures     ${FOLDER}/report.json
  block file  ${FOLDER}/terrain.rpb
  scene       ${FOLDER}/terrain/scene.pbrt
")
