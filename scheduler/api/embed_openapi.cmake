# cmake -DJSON=… -DOUT=… -P embed_openapi.cmake: the API's description as a C++ text.
file(READ ${JSON} text)
file(WRITE ${OUT} "#include \"scheduler/api/openapi.h\"

namespace vantage {

std::string_view openapi_text() {
  return R\"__json__(${text})__json__\";
}

}  // namespace vantage
")
