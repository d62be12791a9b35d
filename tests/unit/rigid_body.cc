#define BOOST_TEST_MODULE rigid_body
#include <boost/test/included/unit_test.hpp>

#include <peat/contact/rigid_body.h>
#include <peat/contact/shape_moments.h>

#include "section.h"

#include <cmath>
#include <random>

using namespace peat;
using dealii::Point;

namespace {
const double pi = std::acos(-1.);

template <int dim>
std::shared_ptr<const Shape<dim>> shape(const std::string &text)
{
  return parse_shape<dim>(text, {}, Origin{"case.prm", 7});
}

template <int dim>
RigidBody<dim> body(const std::string &lines)
{
  return from_text(lines,
                   [](const Section &section) { return RigidBody<dim>(RigidBodyParameters<dim>(section)); });
}

/// The message with which a section is refused; "" if it is not.
template <int dim>
std::string refusal(const std::string &lines)
{
  try {
    from_text(lines, [](const Section &section) { return RigidBodyParameters<dim>(section).name; });
  } catch (const InputError &error) {
    return error.what();
  }
  return "";
}

template <int dim>
void check_refused(const std::string &lines, const std::vector<std::string> &parts_of_message)
{
  const std::string message = refusal<dim>(lines);
  BOOST_TEST_INFO(lines << " -> " << message);
  BOOST_TEST(message.find('\n') == std::string::npos);
  for (const std::string &part : parts_of_message) {
    BOOST_TEST_INFO("'" << message << "' lacks '" << part << "'");
    BOOST_TEST((message.find(part) != std::string::npos));
  }
}

template <int rank, int dim>
void check_near(const dealii::Tensor<rank, dim> &found, const dealii::Tensor<rank, dim> &expected,
                const double tolerance)
{
  BOOST_TEST_INFO(found << " instead of " << expected << ", off by " << (found - expected).norm());
  BOOST_TEST((found - expected).norm() <= tolerance);
}

template <int dim>
void check_moments(const std::string &text, const double volume, const Point<dim> &centroid,
                   const dealii::Tensor<2, dim> &second, const double tolerance)
{
  const ShapeMoments<dim> found = moments(*shape<dim>(text));
  BOOST_TEST_INFO(text << ": volume " << found.volume << " instead of " << volume);
  BOOST_TEST(std::abs(found.volume - volume) <= tolerance * volume);
  BOOST_TEST_INFO(text);
  check_near(dealii::Tensor<1, dim>(found.centroid), dealii::Tensor<1, dim>(centroid),
             tolerance * std::sqrt(second.norm() / volume));
  BOOST_TEST_INFO(text);
  check_near(found.second, second, tolerance * second.norm());
}

/// Of a body that is symmetric about an axis: along it and across.
dealii::Tensor<2, 3> about_axis(dealii::Tensor<1, 3> axis, const double along, const double across)
{
  axis /= axis.norm();
  dealii::Tensor<2, 3> result = (along - across) * outer_product(axis, axis);
  for (unsigned int d = 0; d < 3; ++d)
    result[d][d] += across;
  return result;
}

template <int dim>
dealii::Tensor<2, dim> diagonal(const std::array<double, dim> &values)
{
  dealii::Tensor<2, dim> result;
  for (unsigned int d = 0; d < dim; ++d)
    result[d][d] = values[d];
  return result;
}
} // namespace

BOOST_AUTO_TEST_CASE(moments_of_boxes_balls_and_cylinders)
{
  check_moments<2>("box(1, 2, 3, 7)", 10., {2., 4.5}, diagonal<2>({10. * 4. / 12., 10. * 25. / 12.}), 1e-9);
  check_moments<2>("ball(100, -3, 2)", 4. * pi, {100., -3.}, diagonal<2>({4. * pi, 4. * pi}), 1e-7);
  const double c = std::cos(pi / 6.), s = std::sin(pi / 6.), a = 6. * 9. / 12., b = 6. * 4. / 12.;
  check_moments<2>("rotate(box(-1.5, -1, 1.5, 1), 30, 0, 0)", 6., {},
                   dealii::Tensor<2, 2>(
                       {{c * c * a + s * s * b, c * s * (a - b)}, {c * s * (a - b), s * s * a + c * c * b}}),
                   1e-7);
  check_moments<2>("polygon(0, 0, 3, 0, 0, 3)", 4.5, {1., 1.},
                   dealii::Tensor<2, 2>({{4.5 * 0.5, -4.5 * 0.25}, {-4.5 * 0.25, 4.5 * 0.5}}), 1e-7);

  check_moments<3>("box(0, 0, 0, 1, 2, 3)", 6., {0.5, 1., 1.5}, diagonal<3>({0.5, 2., 4.5}), 1e-9);
  const double ball = 4. / 3. * pi;
  check_moments<3>("ball(5, 0, 100, 1)", ball, {5., 0., 100.}, diagonal<3>({ball / 5, ball / 5, ball / 5}),
                   1e-6);
  const dealii::Tensor<1, 3> axis({0.6, 0.4, 1.});
  const double L = axis.norm(), r = 0.7, cylinder = pi * r * r * L;
  check_moments<3>("cylinder(-0.3, -0.2, -0.5, 0.3, 0.2, 0.5, 0.7)", cylinder, {},
                   about_axis(axis, cylinder * L * L / 12., cylinder * r * r / 4.), 1.2e-6);
  const double hole = ball * 0.729;
  check_moments<3>(
      "difference(ball(0, 0, 0, 1), ball(0, 0, 0, 0.9))", ball - hole, {},
      diagonal<3>({(ball - 0.81 * hole) / 5, (ball - 0.81 * hole) / 5, (ball - 0.81 * hole) / 5}), 1e-6);
}
