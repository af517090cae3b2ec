# cmake -DLCM_GEN=… -DLCM=… -DOUT=… -P generate.cmake: the wire types as C++.
execute_process(COMMAND ${LCM_GEN} --cpp --cpp-std=c++11 --cpp-hpath ${OUT} ${LCM} COMMAND_ERROR_IS_FATAL ANY)
# LCM 1.3.1 takes the length of a text from the datagram and asks only whether it is too long: one below 1 would have its
# decoder read far outside of the datagram.
file(GLOB_RECURSE headers ${OUT}/*.hpp)
foreach(header ${headers})
  file(READ ${header} text)
  string(REGEX REPLACE "if\\(([A-Za-z_0-9]+) > maxlen - pos\\) return -1;" "if(\\1 < 1 || \\1 > maxlen - pos) return -1;" text "${text}")
  file(WRITE ${header} "${text}")
endforeach()
