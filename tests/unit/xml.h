// Well-formed XML or not.
#pragma once

#include <expat.h>

#include <memory>
#include <string>

namespace halflight::test {

/// The parser's complaint with its line; empty where there is none.
inline std::string xml_error(const std::string& text) {
    const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate("UTF-8"),
                                                                              XML_ParserFree);
    if (XML_Parse(parser.get(), text.data(), static_cast<int>(text.size()), 1) == XML_STATUS_OK) return "";
    return std::string(XML_ErrorString(XML_GetErrorCode(parser.get()))) + " in line " +
           std::to_string(XML_GetCurrentLineNumber(parser.get()));
}

}  // namespace halflight::test
