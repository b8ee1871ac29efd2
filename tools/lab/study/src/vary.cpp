#include <vdbfrac/lab/study/vary.h>

#include <vdbfrac/base/error.h>

#include <algorithm>
#include <cctype>

namespace vdbfrac::lab::study {

std::vector<std::string> split(const std::string& text, char separator)
{
    std::vector<std::string> parts(1);
    int depth = 0;
    char quote = 0;
    for (const char c : text) {
        if (quote ? c == quote : c == '"' || c == '\'') quote = quote ? 0 : c;
        if (!quote) depth += int(c == '[' || c == '{') - int(c == ']' || c == '}');
        if (c == separator && depth == 0 && !quote)
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

std::string quotedWord(const std::string& text)
{
    const auto inWord = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-'; };
    const bool word = !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) &&
                      std::all_of(text.begin(), text.end(), inWord);
    return word && text != "true" && text != "false" && text != "inf" && text != "nan" ? '"' + text + '"' : text;
}

Varied parseVary(const std::string& text)
{
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos)
        throw InputError({"--vary", "'" + text + "' varies nothing", "KEY=VALUE,VALUE,...", ""});
    Varied v{text.substr(0, equals), split(text.substr(equals + 1), ',')};
    for (std::string& value : v.values) value = quotedWord(value);
    return v;
}

std::vector<std::vector<std::string>> combinations(std::span<const Varied> varied)
{
    std::vector<std::vector<std::string>> all(1);
    for (const Varied& v : varied) {
        std::vector<std::vector<std::string>> longer;
        for (const auto& before : all)
            for (const std::string& value : v.values) {
                longer.push_back(before);
                longer.back().push_back(v.key + "=" + value);
            }
        all = std::move(longer);
    }
    return all;
}

}  // namespace vdbfrac::lab::study
