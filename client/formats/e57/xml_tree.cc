#include "client/formats/e57/xml_tree.h"

#include <algorithm>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "client/formats/number_text.h"
#include "core/base/status_macros.h"

namespace rilievo::e57 {
namespace {

using std::string_view;

constexpr int kMostNested = 64;
constexpr int kMostParts = 2'000'000;  // elements and attributes

struct Entity {
  string_view name;
  char character;
};
constexpr Entity kEntities[] = {
    {"lt", '<'}, {"gt", '>'}, {"amp", '&'}, {"apos", '\''}, {"quot", '"'}};

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

bool EndsName(char c) { return IsBlank(c) || string_view("<>/='\"&").find(c) != string_view::npos; }

class XmlParser {
 public:
  explicit XmlParser(string_view text) : text_(text) {}

  absl::StatusOr<XmlElement> Parse() {
    RILIEVO_RETURN_IF_ERROR(PassMisc());
    if (Rest().substr(0, 1) != "<") return Error("an element is due");
    XmlElement root;
    RILIEVO_RETURN_IF_ERROR(TakeElement(1, &root));
    return root;
  }

 private:
  string_view Rest() const { return text_.substr(at_); }

  template <typename... What>
  absl::Status Error(const What&... what) const {
    const auto line = 1 + std::count(text_.begin(), text_.begin() + at_, '\n');
    return absl::InvalidArgumentError(absl::StrCat(
        "E57: line ", line, " of the XML section: ", what..., "; damaged file? export it again"));
  }

  bool Accept(string_view token) {
    if (Rest().substr(0, token.size()) != token) return false;
    at_ += token.size();
    return true;
  }

  void PassBlanks() {
    while (at_ < text_.size() && IsBlank(text_[at_])) ++at_;
  }

  // The text up to `end`, which is passed too.
  absl::StatusOr<string_view> TakeUntil(string_view end) {
    const size_t found = text_.find(end, at_);
    if (found == string_view::npos) return Error(Quoted(end), " is missing");
    const string_view taken = text_.substr(at_, found - at_);
    at_ = found + end.size();
    return taken;
  }

  // A comment or a processing instruction, such as the declaration; false where there is neither.
  absl::StatusOr<bool> PassAside() {
    const bool comment = Accept("<!--");
    if (!comment && !Accept("<?")) return false;
    RILIEVO_RETURN_IF_ERROR(TakeUntil(comment ? "-->" : "?>").status());
    return true;
  }

  absl::Status PassMisc() {
    Accept("\xef\xbb\xbf");  // byte order mark
    for (;;) {
      PassBlanks();
      RILIEVO_ASSIGN_OR_RETURN(const bool passed, PassAside());
      if (!passed) return absl::OkStatus();
    }
  }

  absl::StatusOr<string_view> TakeName() {
    const size_t begin = at_;
    while (at_ < text_.size() && !EndsName(text_[at_])) ++at_;
    if (at_ == begin) return Error("a name is due");
    return text_.substr(begin, at_ - begin);
  }

  absl::Status AppendText(string_view raw, std::string* text) const {
    for (size_t ampersand; (ampersand = raw.find('&')) != string_view::npos;) {
      text->append(raw.substr(0, ampersand));
      raw.remove_prefix(ampersand + 1);
      const string_view name = raw.substr(0, raw.find(';'));
      const Entity* entity = std::find_if(std::begin(kEntities), std::end(kEntities),
                                          [&](const Entity& known) { return known.name == name; });
      const bool numbered = name.substr(0, 1) == "#";
      if (name.size() == raw.size() || (!numbered && entity == std::end(kEntities))) {
        return Error("the entity ", Quoted(name), " is not known");
      }
      // Numbered characters occur in names and descriptions, which are not used.
      text->push_back(numbered ? '?' : entity->character);
      raw.remove_prefix(name.size() + 1);
    }
    text->append(raw);
    return absl::OkStatus();
  }

  absl::Status CountPart() {
    if (++parts_ <= kMostParts) return absl::OkStatus();
    return Error("more than ", kMostParts, " elements and attributes");
  }

  absl::Status TakeAttribute(XmlElement* element) {
    RILIEVO_RETURN_IF_ERROR(CountPart());
    RILIEVO_ASSIGN_OR_RETURN(const string_view name, TakeName());
    PassBlanks();
    if (!Accept("=")) return Error("'=' is due behind the attribute ", Quoted(name));
    PassBlanks();
    const string_view quote = Rest().substr(0, 1);
    if (quote != "\"" && quote != "'") return Error("a quote is due for ", Quoted(name));
    ++at_;
    RILIEVO_ASSIGN_OR_RETURN(const string_view value, TakeUntil(quote));
    auto& attribute = element->attributes.emplace_back(name, std::string());
    return AppendText(value, &attribute.second);
  }

  // From '<' to the end of the element.
  absl::Status TakeElement(int depth, XmlElement* element) {
    if (depth > kMostNested) return Error("more than ", kMostNested, " nested elements");
    RILIEVO_RETURN_IF_ERROR(CountPart());
    if (Rest().substr(0, 2) == "<!") {
      return Error(Quoted(Rest().substr(0, Rest().find(' '))), " has no place in E57");
    }
    ++at_;
    RILIEVO_ASSIGN_OR_RETURN(const string_view name, TakeName());
    element->name = name;
    for (PassBlanks(); !Accept(">"); PassBlanks()) {
      if (Accept("/>")) return absl::OkStatus();
      RILIEVO_RETURN_IF_ERROR(TakeAttribute(element));
    }
    return TakeContent(depth, element);
  }

  // What stands between the tags, and the closing tag.
  absl::Status TakeContent(int depth, XmlElement* element) {
    for (;;) {
      const size_t begin = at_;
      at_ = std::min(text_.find('<', begin), text_.size());
      RILIEVO_RETURN_IF_ERROR(AppendText(text_.substr(begin, at_ - begin), &element->text));
      if (Accept("</")) return TakeClosingTag(*element);
      if (Accept("<![CDATA[")) {
        RILIEVO_ASSIGN_OR_RETURN(const string_view data, TakeUntil("]]>"));
        element->text.append(data);
        continue;
      }
      RILIEVO_ASSIGN_OR_RETURN(const bool passed, PassAside());
      if (passed) continue;
      if (at_ == text_.size()) return Error("<", element->name, "> is not closed");
      RILIEVO_RETURN_IF_ERROR(TakeElement(depth + 1, &element->children.emplace_back()));
    }
  }

  absl::Status TakeClosingTag(const XmlElement& element) {
    RILIEVO_ASSIGN_OR_RETURN(const string_view name, TakeName());
    PassBlanks();
    if (name != element.name || !Accept(">")) {
      return Error("</", element.name, "> is due, there is ", Quoted(name));
    }
    return absl::OkStatus();
  }

  const string_view text_;
  size_t at_ = 0;
  int parts_ = 0;
};

}  // namespace

const XmlElement* XmlElement::Child(string_view child) const {
  for (const XmlElement& element : children) {
    if (element.name == child) return &element;
  }
  return nullptr;
}

const std::string* XmlElement::Attribute(string_view attribute) const {
  for (const auto& [key, value] : attributes) {
    if (key == attribute) return &value;
  }
  return nullptr;
}

absl::StatusOr<XmlElement> ParseXml(string_view text) { return XmlParser(text).Parse(); }

}  // namespace rilievo::e57
