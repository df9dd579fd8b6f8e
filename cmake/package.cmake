# mirrorfield-rig_VERSION_ARCH.deb: what a rig needs, and nothing of the desk. Build mirrorfieldd (and
# mirrorfield-status), then `cpack -G DEB` in the build folder. It installs under /usr whatever the prefix is.
set(rig_programs mirrorfieldd)
if(TARGET mirrorfield-status)
  list(APPEND rig_programs mirrorfield-status)
endif()
install(TARGETS ${rig_programs} RUNTIME DESTINATION bin COMPONENT rig)
install(FILES systemd/mirrorfieldd.service DESTINATION lib/systemd/system COMPONENT rig)
if(TARGET mirrorfield-status)
  install(FILES systemd/mirrorfield-status.service DESTINATION lib/systemd/system COMPONENT rig)
endif()
install(FILES systemd/sysusers.d/mirrorfield.conf DESTINATION lib/sysusers.d COMPONENT rig)
install(FILES udev/60-mirrorfield.rules DESTINATION lib/udev/rules.d COMPONENT rig)
install(FILES systemd/sysctl.d/60-mirrorfield.conf DESTINATION share/doc/mirrorfield-rig/examples COMPONENT rig)
install(FILES packaging/copyright DESTINATION share/doc/mirrorfield-rig COMPONENT rig)
install(FILES device/mirrorfieldd.toml.example DESTINATION /etc/mirrorfield RENAME mirrorfieldd.toml COMPONENT rig)

# Compressed while installing, without name and time in it: the same tree gives the same package.
set(rig_pages mirrorfieldd.8 mirrorfieldd.toml.5)
if(TARGET mirrorfield-status)
  list(APPEND rig_pages mirrorfield-status.8)
endif()
foreach(page IN LISTS rig_pages)
  string(REGEX MATCH "[0-9]$" section ${page})
  set(packed ${PROJECT_BINARY_DIR}/man/${page}.gz)
  add_custom_command(
    OUTPUT ${packed}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/man
    COMMAND gzip -9nc ${PROJECT_SOURCE_DIR}/docs/man/${page} > ${packed}
    DEPENDS docs/man/${page} VERBATIM)
  list(APPEND packed_pages ${packed})
  install(FILES ${packed} DESTINATION share/man/man${section} COMPONENT rig)
endforeach()
add_custom_target(mf_man_pages ALL DEPENDS ${packed_pages})
add_dependencies(mirrorfieldd mf_man_pages)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME mirrorfield)
set(CPACK_PACKAGE_CONTACT "The Mirrorfield authors <mirrorfield@localhost>")
set(CPACK_PACKAGE_VENDOR Mirrorfield)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL rig)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
                                                WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_RIG_PACKAGE_NAME mirrorfield-rig)
set(CPACK_DEBIAN_RIG_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RIG_DESCRIPTION "captures the light of a real place with a camera and a mirror: the rig
The daemon that records mirror captures from a GigE Vision, USB3 Vision or V4L2 camera, started by one
button, and the page that shows it to a phone; with systemd units and udev rules.")
set(CPACK_DEBIAN_RIG_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RIG_PACKAGE_DEPENDS "udev, systemd")
set(CPACK_DEBIAN_RIG_PACKAGE_CONTROL_EXTRA
    "${PROJECT_SOURCE_DIR}/packaging/postinst;${PROJECT_SOURCE_DIR}/packaging/prerm;${PROJECT_SOURCE_DIR}/packaging/postrm;${PROJECT_SOURCE_DIR}/packaging/conffiles"
)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
