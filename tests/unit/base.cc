// Texts and expressions: values, and what is refused and how.

#define BOOST_TEST_MODULE base
#include <boost/test/unit_test.hpp>

#include "base_scene.h"

#include <peat/base/text.h>

#include <cmath>
#include <cstring>
#include <random>

BOOST_AUTO_TEST_SUITE(texts)

BOOST_AUTO_TEST_CASE(numbers_are_short_and_exact)
{
  for (const auto &[number, text] :
       std::vector<std::pair<double, std::string>>{{1e7, "1e7"},
                                                   {0.25, "0.25"},
                                                   {-3., "-3"},
                                                   {1e-7, "1e-7"},
                                                   {2650., "2650"},
                                                   {1e100, "1e100"},
                                                   {2.5e-10, "2.5e-10"},
                                                   {0., "0"},
                                                   {0.1 + 0.2, "0.30000000000000004"}})
    BOOST_TEST(to_text(number) == text);
  std::mt19937_64 random(1);
  for (unsigned int i = 0; i < 10000; ++i) {
    const std::uint64_t bits = random();
    double number;
    std::memcpy(&number, &bits, sizeof(number));
    if (std::isfinite(number))
      BOOST_REQUIRE(evaluate(to_text(number), {}, {}) == number);
  }
}

BOOST_AUTO_TEST_CASE(nearest_words)
{
  const std::vector<std::string> words = {"Young modulus", "Poisson ratio", "Law", "h"};
  BOOST_TEST(nearest("Yuong modulus", words) == "Young modulus");
  BOOST_TEST(nearest("YOUNG MODULUS", words) == "Young modulus");
  BOOST_TEST(nearest("law", words) == "Law");
  BOOST_TEST(nearest("Lwa", words) == "Law");
  BOOST_TEST(nearest("H", words) == "h");
  BOOST_TEST(nearest("g", words) == "");
  BOOST_TEST(nearest("Density", words) == "");
  BOOST_TEST(nearest(std::string(1000000, 'x'), words) == "");
  BOOST_TEST(nearest("", words) == "");
}

BOOST_AUTO_TEST_CASE(quotes_are_short)
{
  BOOST_TEST(in_quotes(std::string("a\nb")) == "'a?b'");
  BOOST_TEST(in_quotes(std::string(1000, 'x')).size() < 70);
  // Not cut in the middle of a character of two bytes.
  BOOST_TEST(shortened("a\xC3\xA9", 2) == "a...");
}

BOOST_AUTO_TEST_SUITE_END()

BOOST_AUTO_TEST_SUITE(expressions)

BOOST_AUTO_TEST_CASE(values)
{
  const Constants constants = {{"Width", 10.}, {"h", 0.25}};
  BOOST_TEST(evaluate("Width/h", constants, {}) == 40.);
  BOOST_TEST(evaluate("1e7", {}, {}) == 1e7);
  BOOST_TEST(evaluate(" -2.5 ", {}, {}) == -2.5);
  BOOST_TEST(evaluate("min(Width, 3)", constants, {}) == 3.);
  BOOST_TEST(evaluate("pi", {}, {}) == M_PI);
  BOOST_TEST(evaluate("log(e)", {}, {}) == 1.);
  BOOST_TEST(evaluate("e", {{"e", 0.6}}, {}) == 0.6);
  BOOST_TEST(evaluate("inf", {{"inf", 0.1}}, {}) == 0.1);
  BOOST_TEST(evaluate("if(Width >= 10, pow(2, 3), floor(0.5))", constants, {}) == 8.);
  BOOST_TEST(evaluate("Width == 10 ? 1 : 2", constants, {}) == 1.);
  BOOST_TEST(evaluate("30*24*3600", {}, {}) == 2592000.);
}

BOOST_AUTO_TEST_CASE(splitting)
{
  using Parts = std::vector<std::string>;
  BOOST_TEST((split_outside_parentheses("min(1,2), x") == Parts{"min(1,2)", "x"}));
  BOOST_TEST((split_outside_parentheses("") == Parts{}));
  BOOST_TEST((split_outside_parentheses(" a ,, ") == Parts{"a", "", ""}));
  BOOST_TEST((split_outside_parentheses("a; b(c; d)", ';') == Parts{"a", "b(c; d)"}));
  BOOST_TEST((split_outside_parentheses("f(1,2") == Parts{"f(1,2"}));
  BOOST_TEST((split_outside_parentheses("a), b") == Parts{"a)", "b"}));
}

BOOST_AUTO_TEST_CASE(functions)
{
  const double x[3] = {1., 2., 3.};
  const Function zero;
  BOOST_TEST(zero.n_components() == 1u);
  BOOST_TEST(zero.is_constant());
  BOOST_TEST(zero.value(x, 1.) == 0.);

  Function a("2*q, x + 10*y + 100*z + 1000*t, q*(t < 1)", {{"q", 4.}}, {});
  BOOST_TEST(a.n_components() == 3u);
  BOOST_TEST(!a.is_constant());
  BOOST_TEST(!a.is_uniform());
  BOOST_TEST(a.value(x, 4., 0) == 8.);
  BOOST_TEST(a.value(x, 4., 1) == 4321.);
  BOOST_TEST(a.value(x, 0.5, 2) == 4.);
  BOOST_TEST(a.value(x, 1.5, 2) == 0.);

  const Function uniform("sin(t)", {}, {});
  BOOST_TEST(!uniform.is_constant());
  BOOST_TEST(uniform.is_uniform());
  const Function constant("sqrt(2*9.81*3), pi", {}, {});
  BOOST_TEST(constant.is_constant());
  BOOST_TEST(constant.is_uniform());
  // A constant with the name of no variable, but with letters of one.
  BOOST_TEST(Function("xt", {{"xt", 1.}}, {}).is_constant());
  BOOST_TEST(!Function("max(x, y)", {}, {}).is_uniform());

  // Copies evaluate with variables of their own, also when the original is gone.
  Function copy;
  {
    const Function original("x*t", {}, {});
    copy = original;
    BOOST_TEST(original.value(x, 5.) == 5.);
  }
  const double other[3] = {7., 0., 0.};
  BOOST_TEST(copy.value(other, 2.) == 14.);
  const Function moved = std::move(copy);
  BOOST_TEST(moved.value(other, 3.) == 21.);
  BOOST_TEST(moved.text() == "x*t");
}

BOOST_AUTO_TEST_CASE(functions_that_are_not_finite)
{
  const double zero[3] = {0., 0., 0.};
  // At the origin it need not have a value.
  const Function singular("0, 1/x", {}, {"case.prm", 7});
  const double one[3] = {1., 0., 0.};
  BOOST_TEST(singular.value(one, 0., 1) == 1.);
  try {
    singular.value(zero, 2., 1);
    BOOST_ERROR("no NumericalError");
  } catch (const NumericalError &error) {
    BOOST_TEST(std::string(error.what()) ==
               "case.prm:7: '0, 1/x' is not finite at x = 0, y = 0, z = 0, t = 2");
  }
}

BOOST_AUTO_TEST_CASE(refused)
{
  const Constants constants = {{"Width", 10.}};
  const Origin origin = {"case.prm", 3};
  for (const auto &[text, word] : std::vector<std::pair<std::string, std::string>>{
           {"", "empty"},
           {"  ", "empty"},
           {"1, 2", "one value"},
           {"(1, 2)", "cannot read"},
           {"Widht/2", "unknown name 'Widht' in 'Widht/2'; did you mean 'Width'?"},
           {"foo(1)", "unknown name 'foo'"},
           {"2*x", "place and time cannot enter"},
           {"1/0", "not finite"},
           {"log(-1)", "not finite"},
           {"inf", "'inf' is not finite"},
           {"-nan", "'-nan' is not finite"},
           {"1e999", "1e999"},
           {"2e", "2e"},
           {"2 3", "cannot read"},
           {"((1", "parenthesis"},
           {"1)", "parenthesis"},
           {"-", "incomplete"},
           {"2*", "cannot read"},
           {"sin", "misplaced 'sin'"},
           {"sin(1, 2)", "sin"},
           {"Width = 3", "write '=='"},
           {"\"abc\"", "unexpected character"},
           {"3 \xE2\x88\x92 2", "unexpected character"},
           {"1;2", "cannot read"},
           {"1 ? 2", "else"},
           {"1.2.3", "cannot read"},
           {std::string(100000, '('), "cannot read"},
       }) {
    const std::string message =
        message_of([&, &expression = text] { evaluate(expression, constants, origin); });
    BOOST_TEST(has(message, "case.prm:3: "), message);
    BOOST_TEST(has(message, word), message);
  }
  BOOST_TEST(has(message_of([] { Function("x = 3", {}, {}); }), "'=='"));
  BOOST_TEST(has(message_of([] { Function("0,, 1", {}, {}); }), "empty"));
  BOOST_TEST(has(message_of([] { Function("", {}, {}); }), "empty"));
  BOOST_TEST(has(message_of([] { Function("0, 1/0", {}, {}); }), "'1/0' is not finite"));
  BOOST_TEST(has(message_of([] { Function("0, x + w", {}, {}); }), "unknown name 'w'"));
  BOOST_TEST(has(message_of([] { Function("x y", {}, {}); }), "cannot read 'x y'"));
  BOOST_TEST(has(message_of([] { evaluate("1 + 1", {{"sin", 1.}}, {}); }), "is a function"));
  BOOST_TEST(has(message_of([] { evaluate("1 + 1", {{"t", 1.}}, {}); }), "place or time"));
}

BOOST_AUTO_TEST_SUITE_END()
