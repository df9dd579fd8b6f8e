# One target carries the warnings (and the sanitizers) for every target of ours.
add_library(mf_warnings INTERFACE)
target_compile_options(mf_warnings INTERFACE -Wall -Wextra -Wconversion -Wshadow
                                             $<$<BOOL:${MIRRORFIELD_WERROR}>:-Werror>)
if(MIRRORFIELD_SANITIZE)
  target_compile_options(mf_warnings INTERFACE -fsanitize=${MIRRORFIELD_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(mf_warnings INTERFACE -fsanitize=${MIRRORFIELD_SANITIZE})
endif()
