// Pages that need nothing else: style and pictures are part of them. Light and dark.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace meniscus {

/// A whole page: `style` is CSS after the house's own, `body` the HTML between <main> and </main>.
std::string html_page(const std::string& title, const std::string& style, const std::string& body);

/// For text between tags and in attributes, also of XML: see well_formed().
std::string escaped(const std::string& text);

std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace meniscus
