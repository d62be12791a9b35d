#pragma once

// Reads back what pictures say. Include after Boost.Test.

#include <deal.II/base/utilities.h>

#include <boost/property_tree/xml_parser.hpp>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <zlib.h>

/// The numbers of a compressed array, from its block header on.
inline std::vector<float> decode(const std::string &text)
{
  const auto header = dealii::Utilities::decode_base64(text.substr(0, 24));
  std::uint32_t sizes[4]; // number of blocks, size of a block, of the last block, compressed
  std::memcpy(sizes, header.data(), sizeof(sizes));
  BOOST_REQUIRE(sizes[0] == 1u);
  const auto data = dealii::Utilities::decode_base64(text.substr(24));
  std::vector<float> numbers(sizes[1] / sizeof(float));
  uLongf length = sizes[1];
  BOOST_REQUIRE(uncompress(reinterpret_cast<Bytef *>(numbers.data()), &length, data.data(), data.size()) ==
                Z_OK);
  return numbers;
}

/// All pieces' numbers under a name. The group "Points" holds three coordinates a point, called "".
inline std::vector<float> array(const std::string &file, const std::string &name, std::size_t &n_points,
                                const std::string &group = "PointData")
{
  boost::property_tree::ptree tree;
  boost::property_tree::read_xml(file, tree);
  std::vector<float> numbers;
  n_points = 0;
  for (const auto &[tag, piece] : tree.get_child("VTKFile.UnstructuredGrid")) {
    if (tag != "Piece")
      continue;
    n_points += piece.get<std::size_t>("<xmlattr>.NumberOfPoints");
    for (const auto &[kind, data] : piece.get_child(group))
      if (kind == "DataArray" && data.get<std::string>("<xmlattr>.Name", "") == name) {
        std::string text = data.data();
        text.erase(std::remove_if(text.begin(), text.end(), [](unsigned char c) { return std::isspace(c); }),
                   text.end());
        const auto part = decode(text);
        numbers.insert(numbers.end(), part.begin(), part.end());
      }
  }
  return numbers;
}
