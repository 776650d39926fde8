#include "daemon/commands/render/formula.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>

#include "core/base/geometry.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"

namespace sonar::render {
namespace {

std::string quoted(std::string_view text) { return std::string("\"").append(text).append("\""); }
bool begins_name(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool in_name(char c) { return begins_name(c) || is_digit(c); }

struct Function {
  std::string_view name;
  double (*of)(double);
};
constexpr Function functions[] = {
    {"log10", [](double x) { return std::log10(x); }}, {"ln", [](double x) { return std::log(x); }},
    {"exp", [](double x) { return std::exp(x); }},     {"sqrt", [](double x) { return std::sqrt(x); }},
    {"abs", [](double x) { return std::abs(x); }},     {"sin", [](double x) { return std::sin(x); }},
    {"cos", [](double x) { return std::cos(x); }},     {"tan", [](double x) { return std::tan(x); }},
    {"asin", [](double x) { return std::asin(x); }},   {"acos", [](double x) { return std::acos(x); }},
    {"atan", [](double x) { return std::atan(x); }},   {"deg", [](double x) { return deg_from_rad(x); }},
    {"rad", [](double x) { return rad_from_deg(x); }},
};

/// A recursive descent parser, which stops at the first error.
class Parser {
 public:
  Parser(std::string_view text, const Values& values) : text_(text), values_(values) {}

  Result<double> run() {
    const double value = sum();
    skip_blanks();
    if (wrong_.empty() && at_ < text_.size()) wrong_ = "unexpected " + quoted(text_.substr(at_));
    if (wrong_.empty() && !std::isfinite(value)) wrong_ = "is not a finite number";
    if (!wrong_.empty()) return failure(ErrorKind::config, "formula " + quoted(text_) + ": " + wrong_);
    return value;
  }

 private:
  void skip_blanks() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
  }
  // Skips blanks, and then the character `c` if it is next. Returns true if it skipped `c`.
  bool take(char c) {
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void set_error(std::string what) {
    // Only the first error is kept. The parser is moved to the end of the text, so that all loops end.
    if (wrong_.empty()) wrong_ = std::move(what);
    at_ = text_.size();
  }

  // Grammar: sum = product {(+|-) product}; product = sign {(*|/) sign}; sign = [-] sign | power; power = atom [^ sign];
  // atom = (sum) | number | name | function(sum).
  double sum() {
    double value = product();
    for (;;) {
      if (take('+'))
        value += product();
      else if (take('-'))
        value -= product();
      else
        return value;
    }
  }
  double product() {
    double value = sign();
    for (;;) {
      if (take('*'))
        value *= sign();
      else if (take('/'))
        value /= sign();
      else
        return value;
    }
  }
  double sign() {
    // Every recursion of the grammar calls this function, so the limit here bounds the stack. A sign binds weaker than a power:
    // -2^2 is -4.
    if (++depth_ > most_nested) return set_error("is nested too deeply"), 0;
    const double value = take('-') ? -sign() : power();
    --depth_;
    return value;
  }
  double power() {
    const double base = atom();
    // The exponent may have a sign, and powers group from the right: 2^-1, 2^3^2 = 2^9.
    return take('^') ? std::pow(base, sign()) : base;
  }
  double atom() {
    double value = 0;
    skip_blanks();
    if (take('(')) {
      value = sum();
      if (!take(')')) set_error("a ) is missing");
    } else if (at_ < text_.size() && (is_digit(text_[at_]) || text_[at_] == '.')) {
      value = number();
    } else if (at_ < text_.size() && begins_name(text_[at_])) {
      value = named();
    } else {
      set_error("ends where a value is expected");
    }
    return value;
  }
  double number() {
    std::size_t end = at_;
    while (end < text_.size() && (is_digit(text_[end]) || text_[end] == '.')) ++end;
    if (end < text_.size() && (text_[end] == 'e' || text_[end] == 'E')) {
      ++end;
      if (end < text_.size() && (text_[end] == '-' || text_[end] == '+')) ++end;
      while (end < text_.size() && is_digit(text_[end])) ++end;
    }
    const auto value = text::parse_decimal(text_.substr(at_, end - at_));
    if (!value) return set_error(quoted(text_.substr(at_, end - at_)).append(" is not a number")), 0;
    at_ = end;
    return *value;
  }
  double named() {
    std::size_t end = at_;
    while (end < text_.size() && in_name(text_[end])) ++end;
    const std::string_view name = text_.substr(at_, end - at_);
    at_ = end;
    const auto function =
        std::find_if(std::begin(functions), std::end(functions), [&](const Function& f) { return f.name == name; });
    if (function != std::end(functions)) {
      if (!take('(')) return set_error(std::string(name) + " needs its argument in parentheses"), 0;
      const double argument = sum();
      if (!take(')')) set_error("a ) is missing");
      return function->of(argument);
    }
    if (name == "pi") return pi;
    const auto value = values_.find(name);
    if (value != values_.end()) return value->second;
    const std::string known = text::joined(values_, ", ", &Values::value_type::first);
    set_error("unknown name " + std::string(name) + "; known names: " + (known.empty() ? "none" : known));
    return 0;
  }

  static constexpr int most_nested = 50;
  std::string_view text_;
  const Values& values_;
  std::size_t at_ = 0;
  int depth_ = 0;
  std::string wrong_;
};

/// Returns the end of the $name or $(formula) that begins at `at`; returns `at` if neither begins there.
std::size_t end_of_reference(std::string_view text, std::size_t at) {
  std::size_t end = at + 1;
  if (end < text.size() && text[end] == '(') {
    for (int open = 0; end < text.size() && text[end] != '\n'; ++end) {
      if (text[end] == '(') ++open;
      if (text[end] == ')' && --open == 0) return end + 1;
    }
    return text.size();
  }
  if (end >= text.size() || !begins_name(text[end])) return at;
  while (end < text.size() && in_name(text[end])) ++end;
  return end;
}

}  // namespace

Result<double> evaluate(std::string_view formula, const Values& values) { return Parser(formula, values).run(); }

Result<std::string> substitute(std::string_view text, const Values& values, const std::string& name, int first_line) {
  std::string out;
  std::size_t at = 0;
  for (;;) {
    const std::size_t dollar = text.find('$', at);
    out += text.substr(at, dollar - at);
    if (dollar == std::string_view::npos) return out;
    const std::size_t end = end_of_reference(text, dollar);
    // A $ before anything else, such as a digit, is copied as it is.
    if (end == dollar) {
      out += '$';
      at = dollar + 1;
      continue;
    }
    const auto value = evaluate(text.substr(dollar + 1, end - dollar - 1), values);
    if (!value) {
      // The error has the line of the file, and the formula.
      const auto line = first_line + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(dollar), '\n');
      return failure(ErrorKind::config, name + ":" + std::to_string(line) + ": " + value.error().text);
    }
    // The value is written with 15 digits, so that 0.1 stays 0.1.
    char number[40];
    std::snprintf(number, sizeof number, "%.15g", *value);
    out += number;
    at = end;
  }
}

}  // namespace sonar::render
