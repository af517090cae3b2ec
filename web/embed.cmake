# cmake -DFILES=a;b -DOUTPUT=x.cpp -P embed.cmake: files as bytes in C++, for web/web_files.h.
set(arrays "")
set(entries "")
set(index 0)
foreach(file ${FILES})
  get_filename_component(name ${file} NAME)
  file(READ ${file} hex HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
  string(APPEND arrays "const unsigned char file_${index}[] = {${bytes}};\n")
  string(APPEND entries "    {\"/${name}\", {reinterpret_cast<const char*>(file_${index}), sizeof(file_${index})}},\n")
  math(EXPR index "${index} + 1")
endforeach()
file(WRITE ${OUTPUT} "#include \"web/web_files.h\"\n\nnamespace vantage {\nnamespace {\n${arrays}}  // namespace\n
std::span<const WebFile> web_files() {\n  static const WebFile files[] = {\n${entries}  };\n  return files;\n}\n\n}  // namespace vantage\n")
