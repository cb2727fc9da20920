// What differs between SUNDIALS 6.x and 7.x, in one place.
//     6: SUNContext_Create(void*, …), IDASetErrHandlerFn      7: SUNContext_Create(SUNComm, …),
//     SUNContext_PushErrHandler
#pragma once

#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_config.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_types.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <string>

#if SUNDIALS_VERSION_MAJOR < 6
#error "SUNDIALS 6.x or 7.x is needed"
#endif

static_assert(sizeof(sunrealtype) == sizeof(double), "SUNDIALS must be built in double precision");

namespace spring::compat {

/// @return 0 if the context could be created
inline int create_context(SUNContext* context) {
#if SUNDIALS_VERSION_MAJOR >= 7
  return SUNContext_Create(SUN_COMM_NULL, context);
#else
  return SUNContext_Create(nullptr, context);
#endif
}

#if SUNDIALS_VERSION_MAJOR >= 7
inline void keep_message(int, const char*, const char*, const char* message, SUNErrCode, void* text, SUNContext) {
  if (text != nullptr && message != nullptr) *static_cast<std::string*>(text) = message;
}
#else
inline void keep_message(int, const char*, const char*, char* message, void* text) {
  if (text != nullptr && message != nullptr) *static_cast<std::string*>(text) = message;
}
#endif

/// IDA's messages go to `text` (the last one is kept) instead of stderr. @return 0 on success
inline int redirect_messages([[maybe_unused]] SUNContext context, [[maybe_unused]] void* ida, std::string* text) {
#if SUNDIALS_VERSION_MAJOR >= 7
  SUNContext_ClearErrHandlers(context);
  return SUNContext_PushErrHandler(context, keep_message, text);
#else
  return IDASetErrHandlerFn(ida, keep_message, text);
#endif
}

}  // namespace spring::compat
