#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::array<const char*, 3> domain_names = {"point", "corner", "polygon"};

/// Reorders the elements of an attribute: the one time that values move.
void reorder(MeshAttribute& attribute, const std::vector<std::size_t>& order) {
  const auto components = static_cast<std::size_t>(attribute.components);
  std::visit(
      [&]<class T>(std::vector<T>& values) {
        std::vector<T> moved;
        moved.reserve(order.size() * components);
        for (const std::size_t element : order) {
          const auto first = values.begin() + static_cast<std::ptrdiff_t>(element * components);
          moved.insert(moved.end(), first, first + attribute.components);
        }
        values = std::move(moved);
      },
      attribute.values);
}

bool is_identity(const std::vector<std::size_t>& order, std::size_t elements) {
  if (order.size() != elements) return false;
  for (std::size_t i = 0; i < elements; ++i)
    if (order[i] != i) return false;
  return true;
}

}  // namespace

AttributeTable::Order AttributeTable::polygon_order() const {
  // As MeshBuilder::add_polygon() cuts and drops: triangles and cut polygons first, then the quads.
  Order order, quads;
  for (std::size_t polygon = 0; polygon < polygon_sizes_.size(); ++polygon) {
    const std::uint32_t size = polygon_sizes_[polygon];
    if (size == 4) quads.push_back(polygon);
    if (size == 3 || size > 4) order.insert(order.end(), size - 2, polygon);
  }
  order.insert(order.end(), quads.begin(), quads.end());
  return order;
}

AttributeTable::Order AttributeTable::corner_order() const {
  Order order, quads;
  std::size_t first = 0;
  auto cut = cut_polygons_.begin();
  for (std::size_t polygon = 0; polygon < polygon_sizes_.size(); ++polygon) {
    const std::uint32_t size = polygon_sizes_[polygon];
    if (cut != cut_polygons_.end() && cut->first == polygon) {
      for (const Triangle& triangle : (cut++)->second)
        for (const std::uint32_t corner : triangle) order.push_back(first + corner);
    } else if (size == 4) {
      quads.insert(quads.end(), {first, first + 1, first + 2, first + 3});
    } else {
      // The fan; a polygon of fewer than three corners, which the mesh drops, has no triangle.
      for (std::uint32_t i = 2; i < size; ++i) order.insert(order.end(), {first, first + i - 1, first + i});
    }
    first += size;
  }
  order.insert(order.end(), quads.begin(), quads.end());
  return order;
}

void AttributeTable::spoil(std::size_t column, const std::string& reason) {
  // Nothing is thrown yet: a bad attribute must not cost the mesh.
  std::string& spoiled = columns_[column].spoiled;
  if (spoiled.empty()) spoiled = reason;
}

void AttributeTable::spoil_value(std::size_t column, const std::string& what) {
  const AttributeDomain domain = columns_[column].result.domain;
  if (columns_[column].spoiled.empty())
    spoil(column, std::string("that of ") + domain_names[static_cast<std::size_t>(domain)] + " " +
                      std::to_string(begun(domain) - 1) + " (counting from 0) " + what);
}

void AttributeTable::set_labels(std::size_t column, const std::vector<std::string>& labels) {
  for (const std::string& label : labels) columns_[column].result.labels.push_back(clean_name(label));
}

std::size_t AttributeTable::add(const std::string& name, AttributeDomain domain, int components, bool whole) {
  Column& column = columns_.emplace_back();
  column.result = {clean_name(name), domain, components, std::vector<float>(), {}};
  if (whole) column.result.values = std::vector<std::int32_t>();
  // A name that is taken gets the domain in front, then a number behind until it is free.
  std::string& unused = column.result.name;
  if (names_.contains(unused)) unused = domain_names[static_cast<std::size_t>(domain)] + ("-" + unused);
  const std::string base = unused;
  while (!names_.emplace(unused, 1).second) unused = base + "-" + std::to_string(++names_[base]);
  of_domain_[static_cast<std::size_t>(domain)].push_back(columns_.size() - 1);
  grow(column);
  return columns_.size() - 1;
}

void AttributeTable::grow(Column& column) {
  const std::size_t size = begun(column.result.domain) * static_cast<std::size_t>(column.result.components);
  if (auto* whole = std::get_if<std::vector<std::int32_t>>(&column.result.values))
    whole->resize(size, -1);
  else
    std::get<std::vector<float>>(column.result.values).resize(size, 0.0f);
}

void AttributeTable::reserve(AttributeDomain domain, std::size_t elements) {
  for (const std::size_t column : of_domain_[static_cast<std::size_t>(domain)]) {
    MeshAttribute& attribute = columns_[column].result;
    std::visit(
        [&](auto& values) {
          values.reserve(values.size() + elements * static_cast<std::size_t>(attribute.components));
        },
        attribute.values);
  }
}

void AttributeTable::begin(AttributeDomain domain) {
  ++begun(domain);
  for (const std::size_t column : of_domain_[static_cast<std::size_t>(domain)]) grow(columns_[column]);
}

void AttributeTable::set(std::size_t column, int component, double value) {
  MeshAttribute& attribute = columns_[column].result;
  // An element is counted once, with its first component.
  if (component == 0) ++columns_[column].given;
  const auto newest = [&](auto& values) { return values.end() - attribute.components + component; };
  if (auto* whole = std::get_if<std::vector<std::int32_t>>(&attribute.values)) {
    using Limits = std::numeric_limits<std::int32_t>;
    // Negated to also reject NaN, whose conversion to an integer is undefined.
    if (!(value >= Limits::min() && value <= Limits::max()))
      return spoil_value(column, "does not fit into 32 bits with a sign");
    *newest(*whole) = static_cast<std::int32_t>(value);
    return;
  }
  const auto single = static_cast<float>(value);
  if (!std::isfinite(single)) return spoil_value(column, "is not a finite number in single precision");
  *newest(std::get<std::vector<float>>(attribute.values)) = single;
}

std::size_t AttributeTable::leave_out_spoiled(RunContext& context) {
  // A damaged header may declare thousands of attributes.
  constexpr std::size_t most_notes = 8;
  std::size_t left_out = 0;
  for (const Column& column : columns_) {
    if (column.spoiled.empty()) continue;
    const std::string the_attribute = in_quotes(file_) + ": the attribute " + quoted_word(column.result.name);
    if (std::ranges::find(required_, column.result.name) != required_.end())
      throw Error(joined(the_attribute, " cannot be read: ", column.spoiled));
    if (++left_out <= most_notes) context.note(joined(the_attribute, " was left out: ", column.spoiled));
  }
  if (left_out > most_notes)
    context.note(joined(in_quotes(file_), ": ", left_out - most_notes,
                        " more attributes were left out for similar reasons"));
  std::erase_if(columns_, [](const Column& column) { return !column.spoiled.empty(); });
  return left_out;
}

void AttributeTable::finish(MeshFile& mesh, RunContext& context) {
  mesh.attributes_left_out = leave_out_spoiled(context) > 0;
  // Orders are computed only for domains with attributes: that of corners takes eight bytes per corner.
  std::array<std::optional<Order>, 3> orders;
  for (Column& column : columns_) {
    context.check();
    MeshAttribute& attribute = column.result;
    const AttributeDomain domain = attribute.domain;
    if (const std::size_t missing = begun(domain) - column.given; missing > 0)
      context.note(joined(in_quotes(file_), ": ", missing, " of ", begun(domain), " ",
                          domain_names[static_cast<std::size_t>(domain)], "s have no ",
                          quoted_word(attribute.name), " and get ",
                          (attribute.values.index() == 1 ? "-1" : "0")));
    std::optional<Order>& order = orders[static_cast<std::size_t>(domain)];
    if (!order && domain == AttributeDomain::polygon) order = polygon_order();
    if (!order && domain == AttributeDomain::corner) order = corner_order();
    if (domain == AttributeDomain::point) order = kept_points_;
    // A mesh of triangles only, the common case, is in order already.
    if (order && !is_identity(*order, begun(domain))) reorder(attribute, *order);
    mesh.attributes.push_back(std::move(attribute));
  }
}

}  // namespace hermesh::mesh_formats
