# The manual page and the completions of shells, printed by the program from the options that it takes, and where they are installed.
if(CMAKE_CROSSCOMPILING)
    message(STATUS "No manual page and no completions: the program that prints them does not run here")
    return()
endif()

set(manual ${CMAKE_BINARY_DIR}/manual)
file(MAKE_DIRECTORY ${manual})
set(outputs "")
foreach(kind man bash zsh fish)
    set(output ${manual}/raypager.${kind})
    list(APPEND outputs ${output})
    add_custom_command(OUTPUT ${output} COMMAND $<TARGET_FILE:raypager> generate ${kind} > ${output} DEPENDS raypager VERBATIM)
endforeach()
add_custom_target(manual ALL DEPENDS ${outputs})

install(FILES ${manual}/raypager.man DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 RENAME raypager.1 COMPONENT program)
install(FILES ${manual}/raypager.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME raypager COMPONENT program)
install(FILES ${manual}/raypager.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
# Debian's zsh looks elsewhere for what packages bring than for what is installed by hand.
install(CODE "
    set(folder site-functions)
    if(CMAKE_INSTALL_PREFIX MATCHES \"/usr$\")
        set(folder vendor-completions)
    endif()
    file(INSTALL FILES ${manual}/raypager.zsh DESTINATION \${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/zsh/\${folder} RENAME _raypager)
" COMPONENT program)
