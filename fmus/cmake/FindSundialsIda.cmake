# Finds IDA of SUNDIALS >= 6 and < 8 and provides springbeam::sundials_ida.
# Looked for in CMAKE_PREFIX_PATH, then in the system; a static archive is preferred, so that the FMU carries it.
#
# SUNDIALS' own package files are not used: Debian's name all modules, MPI and PETSc included.

find_path(SundialsIda_INCLUDE_DIR ida/ida.h)
mark_as_advanced(SundialsIda_INCLUDE_DIR)

set(SundialsIda_LIBRARIES "")
# 6.x: IDA's archive holds all it needs. 7.x: the core is an archive of its own.
foreach(part IN ITEMS ida core)
  find_library(SundialsIda_${part}_LIBRARY
    NAMES libsundials_${part}.a sundials_${part}_static sundials_${part}
    PATH_SUFFIXES lib lib64)
  mark_as_advanced(SundialsIda_${part}_LIBRARY)
endforeach()

if(SundialsIda_INCLUDE_DIR AND EXISTS ${SundialsIda_INCLUDE_DIR}/sundials/sundials_config.h)
  file(STRINGS ${SundialsIda_INCLUDE_DIR}/sundials/sundials_config.h config
    REGEX "^#define[ \t]+SUNDIALS_(VERSION|PACKAGE_VERSION|MPI_ENABLED)[ \t]+")
  foreach(line IN LISTS config)
    if(line MATCHES "SUNDIALS_VERSION[ \t]+\"([0-9.]+)")
      set(SundialsIda_VERSION ${CMAKE_MATCH_1})
    elseif(line MATCHES "MPI_ENABLED[ \t]+1")
      set(SundialsIda_MPI TRUE)
    endif()
  endforeach()
endif()

set(accepted "accepted are versions 6.x and 7.x (Debian/Ubuntu: libsundials-dev), or \
name another prefix with -DCMAKE_PREFIX_PATH=… or SPRINGBEAM_PREFIX")
if(SundialsIda_INCLUDE_DIR AND
    (NOT SundialsIda_VERSION OR SundialsIda_VERSION VERSION_LESS 6 OR NOT SundialsIda_VERSION VERSION_LESS 8))
  message(FATAL_ERROR "SUNDIALS ${SundialsIda_VERSION} in ${SundialsIda_INCLUDE_DIR} cannot be used: ${accepted}")
endif()

set(required SundialsIda_ida_LIBRARY SundialsIda_INCLUDE_DIR)
if(SundialsIda_VERSION VERSION_GREATER_EQUAL 7)
  list(APPEND required SundialsIda_core_LIBRARY)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(SundialsIda
  REQUIRED_VARS ${required}
  VERSION_VAR SundialsIda_VERSION
  REASON_FAILURE_MESSAGE "${accepted}")

if(SundialsIda_FOUND AND NOT TARGET springbeam::sundials_ida)
  add_library(springbeam_sundials_ida INTERFACE)
  add_library(springbeam::sundials_ida ALIAS springbeam_sundials_ida)
  target_include_directories(springbeam_sundials_ida SYSTEM INTERFACE ${SundialsIda_INCLUDE_DIR})
  target_link_libraries(springbeam_sundials_ida INTERFACE ${SundialsIda_ida_LIBRARY})
  if(SundialsIda_VERSION VERSION_GREATER_EQUAL 7)
    target_link_libraries(springbeam_sundials_ida INTERFACE ${SundialsIda_core_LIBRARY})
    if(SundialsIda_MPI)  # its headers then include mpi.h; nothing of MPI is linked
      find_package(MPI REQUIRED COMPONENTS C)
      target_include_directories(springbeam_sundials_ida SYSTEM INTERFACE ${MPI_C_INCLUDE_DIRS})
    endif()
  endif()
  if(UNIX)
    target_link_libraries(springbeam_sundials_ida INTERFACE m)
  endif()
endif()
