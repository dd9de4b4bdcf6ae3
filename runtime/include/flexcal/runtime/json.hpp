// JSON documents (RFC 8259), read into a tree of values.
#pragma once
#include <cmath>
#include <locale>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexcal::runtime {

struct Json {
    enum class Kind { null, boolean, number, text, list, object };

    Kind kind = Kind::null;
    bool boolean = false;
    double number = 0;
    std::string text;
    std::vector<Json> items;
    std::vector<std::string> names;  // of the items of an object

    // The member of an object; null where there is none.
    const Json* member(std::string_view name) const {
        for (std::size_t i = 0; kind == Kind::object && i < names.size(); ++i)
            if (names[i] == name) return &items[i];
        return nullptr;
    }
};

class JsonReader {
  public:
    explicit JsonReader(std::string_view text) : text_(text) {}

    // False, with `error` set, where the text is no JSON document.
    bool read(Json& value, std::string& error) {
        if (parse(value, 0)) {
            skip();
            if (at_ == text_.size()) return true;
            fail("something stands after the document");
        }
        error = "line " + std::to_string(line()) + ": " + error_;
        return false;
    }

  private:
    static constexpr int deepest = 64;

    bool fail(const char* problem) {
        if (error_.empty()) error_ = problem;
        return false;
    }

    int line() const {
        int result = 1;
        for (std::size_t i = 0; i < at_ && i < text_.size(); ++i) result += text_[i] == '\n';
        return result;
    }

    void skip() {
        while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\r' || text_[at_] == '\t')) ++at_;
    }

    bool next(char c) {
        skip();
        if (at_ == text_.size() || text_[at_] != c) return false;
        ++at_;
        return true;
    }

    bool word(std::string_view expected) {
        if (text_.substr(at_, expected.size()) != expected) return fail("no value begins like this");
        at_ += expected.size();
        return true;
    }

    bool parse(Json& value, int depth) {
        if (depth > deepest) return fail("lists and objects are nested too deeply");
        skip();
        if (at_ == text_.size()) return fail("the document ends too early");
        switch (text_[at_]) {
            case '{': return object(value, depth);
            case '[': return list(value, depth);
            case '"': value.kind = Json::Kind::text; return string(value.text);
            case 't': value.kind = Json::Kind::boolean, value.boolean = true; return word("true");
            case 'f': value.kind = Json::Kind::boolean; return word("false");
            case 'n': return word("null");
            default: return number(value);
        }
    }

    bool list(Json& value, int depth) {
        value.kind = Json::Kind::list;
        ++at_;
        if (next(']')) return true;
        do {
            value.items.emplace_back();
            if (!parse(value.items.back(), depth + 1)) return false;
        } while (next(','));
        return next(']') || fail("a list does not close");
    }

    bool object(Json& value, int depth) {
        value.kind = Json::Kind::object;
        ++at_;
        if (next('}')) return true;
        do {
            skip();
            value.names.emplace_back();
            value.items.emplace_back();
            if (at_ == text_.size() || text_[at_] != '"' || !string(value.names.back())) return fail("an object has a member without a name");
            if (!next(':')) return fail("a colon is missing after a name");
            if (!parse(value.items.back(), depth + 1)) return false;
        } while (next(','));
        return next('}') || fail("an object does not close");
    }

    bool string(std::string& out) {
        for (++at_; at_ < text_.size(); ++at_) {
            const char c = text_[at_];
            if (c == '"') return ++at_, true;
            if (static_cast<unsigned char>(c) < 0x20) break;
            if (c != '\\') {
                out += c;
            } else if (!escape(out)) {
                return false;
            }
        }
        return fail("a text does not close");
    }

    bool escape(std::string& out) {
        static constexpr std::string_view short_ones = "\"\\/bfnrt", meant = "\"\\/\b\f\n\r\t";
        if (++at_ == text_.size()) return fail("a text does not close");
        const std::size_t k = short_ones.find(text_[at_]);
        if (k != std::string_view::npos) return out += meant[k], true;
        unsigned long code = 0, low = 0;
        if (text_[at_] != 'u' || !hexadecimal(code)) return fail("a text has an unknown escape");
        if (code >= 0xD800 && code < 0xE000) {
            if (code >= 0xDC00 || text_.substr(at_ + 1, 2) != "\\u" || (at_ += 2, !hexadecimal(low)) || low < 0xDC00 || low > 0xDFFF)
                return fail("a text has half of a surrogate pair");
            code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        }
        encode(code, out);
        return true;
    }

    bool hexadecimal(unsigned long& code) {
        static constexpr std::string_view digits = "0123456789abcdef";
        if (text_.size() - at_ < 5) return false;
        for (int i = 0; i < 4; ++i) {
            const char c = text_[++at_];
            const std::size_t k = digits.find(c >= 'A' && c <= 'F' ? static_cast<char>(c + 32) : c);
            if (k == std::string_view::npos) return false;
            code = 16 * code + k;
        }
        return true;
    }

    static void encode(unsigned long code, std::string& out) {
        if (code < 0x80) {
            out += static_cast<char>(code);
            return;
        }
        const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
        static constexpr unsigned char lead[] = {0, 0xC0, 0xE0, 0xF0};
        out += static_cast<char>(lead[more] | (code >> (6 * more)));
        for (int i = more - 1; i >= 0; --i) out += static_cast<char>(0x80 | ((code >> (6 * i)) & 0x3F));
    }

    bool number(Json& value) {
        value.kind = Json::Kind::number;
        const std::size_t first = at_;
        const auto one_of = [&](std::string_view some) { return at_ < text_.size() && some.find(text_[at_]) != some.npos && ++at_; };
        const auto digits = [&] {
            if (!one_of("0123456789")) return false;
            while (one_of("0123456789")) {}
            return true;
        };
        one_of("-");
        if ((!one_of("0") && !digits()) || (one_of(".") && !digits()) || (one_of("eE") && (one_of("+-"), !digits())))
            return fail("no value begins like this");
        std::istringstream stream{std::string(text_.substr(first, at_ - first))};
        stream.imbue(std::locale::classic());  // whatever the decimal point of the program's locale
        stream >> value.number;
        return !stream.fail() || fail("a number is too large");
    }

    std::string_view text_;
    std::size_t at_ = 0;
    std::string error_;
};

}  // namespace flexcal::runtime
