# cmake -DSQL_DIR=… -DOUT=… -P embed_migrations.cmake: schema/sql/NNNN_*.sql as a C++ table.
file(GLOB files ${SQL_DIR}/[0-9][0-9][0-9][0-9]_*.sql)
list(SORT files)
set(rows "")
foreach(file ${files})
  get_filename_component(name ${file} NAME)
  string(SUBSTRING ${name} 0 4 digits)
  math(EXPR version "1${digits} - 10000")
  file(READ ${file} sql)
  string(APPEND rows "      {${version}, R\"__sql__(${sql})__sql__\"},\n")
endforeach()
file(WRITE ${OUT}.new "#include \"scheduler/store/migrations.h\"

namespace vantage {

const std::vector<Migration>& all_migrations() {
  static const std::vector<Migration> migrations = {
${rows}  };
  return migrations;
}

}  // namespace vantage
")
file(COPY_FILE ${OUT}.new ${OUT} ONLY_IF_DIFFERENT)
