# One target carries the warnings (and the sanitizers) for every target of ours.
add_library(mf_warnings INTERFACE)
# g++ 12 sees array bounds crossed in dead branches of Eigen 3.4 (Vector3f under -O3): a known false alarm.
target_compile_options(mf_warnings INTERFACE -Wall -Wextra -Wconversion -Wshadow -Wno-array-bounds
                                                                                          $<$<BOOL:${MIRRORFIELD_WERROR}>:-Werror>)
if(MIRRORFIELD_UNITY) # judges what only headers should hold by the name of the file, which is another here
  target_compile_options(mf_warnings INTERFACE -Wno-subobject-linkage)
endif()
if(MIRRORFIELD_SANITIZE)
  target_compile_options(mf_warnings INTERFACE -fsanitize=${MIRRORFIELD_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(mf_warnings INTERFACE -fsanitize=${MIRRORFIELD_SANITIZE})
endif()
