#pragma once

#include <boost/test/unit_test.hpp>

#include <deal.II/base/mpi.h>

namespace peat {
/// For tests that are also run under mpirun: BOOST_GLOBAL_FIXTURE(Mpi).
struct Mpi
{
  Mpi()
      : init(boost::unit_test::framework::master_test_suite().argc,
             boost::unit_test::framework::master_test_suite().argv, 1)
  {}
  dealii::Utilities::MPI::MPI_InitFinalize init;
};
} // namespace peat
