# Installs what was built into a folder of its own, builds the example against it, by find_package and by pkg-config, and runs it.
# BUILD: the build folder. FOLDER: to work in.
function(run)
    execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${FOLDER} COMMAND_ECHO STDOUT RESULT_VARIABLE status)
    if(NOT status EQUAL 0)
        message(FATAL_ERROR "failed: ${ARGN}")
    endif()
endfunction()

file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})
file(COPY ${SOURCE}/CMakeLists.txt ${SOURCE}/example.cpp DESTINATION ${FOLDER}/example)  # on a tree without the sources
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${FOLDER}/prefix)
foreach(file bin/raypager share/man/man1/raypager.1 share/bash-completion/completions/raypager share/zsh/site-functions/_raypager
        share/fish/vendor_completions.d/raypager.fish)
    file(SIZE ${FOLDER}/prefix/${file} bytes)
    if(bytes LESS 1000)
        message(FATAL_ERROR "${file} has ${bytes} bytes")
    endif()
endforeach()
run(${CMAKE_COMMAND} -S example -B build -DCMAKE_PREFIX_PATH=${FOLDER}/prefix -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build build)
run(build/example)
find_program(PKG_CONFIG pkg-config)
if(PKG_CONFIG)
    run(sh -c "PKG_CONFIG_PATH=$(dirname $(find $PWD/prefix -name raypager.pc)) && export PKG_CONFIG_PATH && c++ -std=c++20 example/example.cpp -o with_pkg_config $(pkg-config --cflags --libs raypager)")
endif()
