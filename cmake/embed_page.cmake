# cmake -DOUTPUT=page.cpp -DFOLDER=page -P embed_page.cmake: FOLDER/page.html with page.css and page.js put into it, as one
# C++ file, with the SHA-256 of both as the page's Content-Security-Policy names them (base64).
function(hash_source text result)
  string(SHA256 hex "${text}")
  # 64 digits: 21 groups of three, and one alone, whose four bits and two more are the 43rd letter; the 44th is padding.
  set(letters ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/)
  set(base64 "")
  foreach(i RANGE 0 20) # three hexadecimal digits are two letters
    math(EXPR at "${i} * 3")
    string(SUBSTRING ${hex} ${at} 3 digits)
    math(EXPR high "0x${digits} >> 6")
    math(EXPR low "0x${digits} & 63")
    string(SUBSTRING ${letters} ${high} 1 first)
    string(SUBSTRING ${letters} ${low} 1 second)
    string(APPEND base64 ${first}${second})
  endforeach()
  string(SUBSTRING ${hex} 63 1 last)
  math(EXPR value "0x${last} << 2")
  string(SUBSTRING ${letters} ${value} 1 first)
  set(${result} "sha256-${base64}${first}=" PARENT_SCOPE)
endfunction()

file(READ ${FOLDER}/page.html page)
file(READ ${FOLDER}/page.css style)
file(READ ${FOLDER}/page.js script)
hash_source("${style}" style_source)
hash_source("${script}" script_source)
string(REPLACE "@STYLE@" "${style}" page "${page}")
string(REPLACE "@SCRIPT@" "${script}" page "${page}")
file(WRITE ${OUTPUT} "// Generated from ${FOLDER} by cmake/embed_page.cmake
#include \"device/status/status_page.h\"

namespace mf {

std::string_view status_page() {
  return R\"page(${page})page\";
}

std::string_view status_page_style_source() {
  return \"${style_source}\";
}

std::string_view status_page_script_source() {
  return \"${script_source}\";
}

}  // namespace mf
")
