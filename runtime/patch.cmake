# Deformable patches: solvers on the host (LAPACK: liblapacke-dev; of any BLAS, libopenblas0-serial is fast), and on the
# device.
pkg_check_modules(LAPACKE REQUIRED IMPORTED_TARGET lapacke)
add_library(scn_patch STATIC
  patch_band.c
  patch_batch.c
  patch_cache.c
  patch_cells.c
  patch_check.c
  patch_contact.c
  patch_device.c
  patch_device_drive.c
  patch_device_read.c
  patch_diagnose.c
  patch_drive.c
  patch_host.c
  patch_mirror.c
  patch_model.c
  patch_modes.c
  patch_pins.c
  patch_scene.c
  patch_state.c)
target_link_libraries(scn_patch PUBLIC scn_runtime scn_patch_kernels PkgConfig::LAPACKE m)
target_include_directories(scn_patch PRIVATE ${XXHASH_INCLUDE_DIRS})
