// The one translation unit that holds the code of Asio and Beast (the *_SEPARATE_COMPILATION macros).
#include <boost/asio/impl/src.hpp>
#include <boost/asio/ssl/impl/src.hpp>
#include <boost/beast/src.hpp>
