#include "algorithms/io/mesh_file_attributes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::array<const char*, 3> domain_names = {"point", "corner", "polygon"};
constexpr std::array<const char*, 3> domain_plurals = {"points", "corners", "polygons"};

const char* name_of(AttributeDomain domain) { return domain_names[static_cast<std::size_t>(domain)]; }

/// Number in the file of each element of the mesh.
using Order = std::vector<std::size_t>;

/// Order of the polygons of the mesh, as MeshBuilder::add_polygon() cuts and drops: triangles and what is cut
/// first, each piece with the number of its polygon, then the quads.
Order polygon_order(const std::vector<std::uint32_t>& sizes) {
  Order order, quads;
  for (std::size_t polygon = 0; polygon < sizes.size(); ++polygon) {
    if (sizes[polygon] == 4) quads.push_back(polygon);
    // All triangles of a polygon repeat its value.
    if (sizes[polygon] == 3 || sizes[polygon] > 4) order.insert(order.end(), sizes[polygon] - 2, polygon);
  }
  order.insert(order.end(), quads.begin(), quads.end());
  return order;
}

template <class T>
void reorder(std::vector<T>& values, std::size_t components, const Order& order) {
  // Values are gathered in the order of the file, because what a polygon becomes is known only when all is
  // read; this is the one time that they move.
  std::vector<T> moved;
  moved.reserve(order.size() * components);
  for (const std::size_t element : order) {
    // The components of an element stay side by side.
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(element * components);
    moved.insert(moved.end(), first, first + static_cast<std::ptrdiff_t>(components));
  }
  values = std::move(moved);
}

bool is_identity(const Order& order, std::size_t elements) {
  if (order.size() != elements) return false;
  for (std::size_t i = 0; i < elements; ++i)
    if (order[i] != i) return false;
  return true;
}

void reorder(MeshAttribute& attribute, const Order& order, std::size_t elements) {
  // A mesh of triangles alone, the common case, is in order already.
  if (is_identity(order, elements)) return;
  std::visit([&](auto& values) { reorder(values, static_cast<std::size_t>(attribute.components), order); },
             attribute.values);
}

}  // namespace

std::vector<std::size_t> AttributeBuilder::corner_order() const {
  Order order, quads;
  std::size_t first = 0;
  // Polygons that were cut into ears come in ascending order, so one iterator keeps step with the polygons.
  auto cut = cut_polygons_.begin();
  for (std::size_t polygon = 0; polygon < polygon_sizes_.size(); ++polygon) {
    const std::uint32_t size = polygon_sizes_[polygon];
    if (cut != cut_polygons_.end() && cut->polygon == polygon) {
      for (const Triangle& triangle : (cut++)->triangles)
        for (const std::uint32_t corner : triangle) order.push_back(first + corner);
    } else if (size == 4) {
      quads.insert(quads.end(), {first, first + 1, first + 2, first + 3});
    } else {
      // The fan; a polygon of fewer than three corners, which the mesh drops, gives none.
      for (std::uint32_t i = 2; i < size; ++i) order.insert(order.end(), {first, first + i - 1, first + i});
    }
    first += size;
  }
  order.insert(order.end(), quads.begin(), quads.end());
  return order;
}

void AttributeBuilder::spoil(std::size_t attribute, const std::string& reason) {
  // Nothing is thrown: a bad attribute must not cost the mesh. It is left out at the end, or is an Error
  // there if it was asked for by name.
  std::string& spoiled = gathered_[attribute].spoiled;
  if (spoiled.empty()) spoiled = reason;
}

void AttributeBuilder::spoil_value(std::size_t attribute, const std::string& what) {
  const AttributeDomain domain = gathered_[attribute].result.domain;
  if (gathered_[attribute].spoiled.empty())
    spoil(attribute, std::string("that of ") + name_of(domain) + " " + std::to_string(begun(domain) - 1) +
                         " (counting from 0) " + what);
}

void AttributeBuilder::set_labels(std::size_t attribute, const std::vector<std::string>& labels) {
  // Labels are text of the file, which may hold what would control a terminal.
  for (const std::string& label : labels) gathered_[attribute].result.labels.push_back(clean_name(label));
}

std::string AttributeBuilder::unused_name(std::string name, AttributeDomain domain) {
  // First the domain goes in front, then a number behind, until nothing has that name.
  if (names_.contains(name)) name = std::string(name_of(domain)) + "-" + name;
  std::string unused = name;
  while (!names_.emplace(unused, 1).second) unused = name + "-" + std::to_string(++names_[name]);
  return unused;
}

std::size_t AttributeBuilder::add(std::string name, AttributeDomain domain, int components, bool whole) {
  Gathered& gathered = gathered_.emplace_back();
  gathered.result = {"", domain, components, std::vector<float>(), {}};
  if (whole) gathered.result.values = std::vector<std::int32_t>();
  gathered.result.name = unused_name(clean_name(name), domain);
  of_domain_[static_cast<std::size_t>(domain)].push_back(gathered_.size() - 1);
  // The elements that have begun without it are filled like those that lack a value.
  grow(gathered);
  return gathered_.size() - 1;
}

void AttributeBuilder::grow(Gathered& gathered) {
  const std::size_t size =
      begun(gathered.result.domain) * static_cast<std::size_t>(gathered.result.components);
  if (auto* whole = std::get_if<std::vector<std::int32_t>>(&gathered.result.values))
    whole->resize(size, -1);
  else
    std::get<std::vector<float>>(gathered.result.values).resize(size, 0.0f);
}

void AttributeBuilder::reserve(AttributeDomain domain, std::size_t elements) {
  for (Gathered& gathered : gathered_)
    if (gathered.result.domain == domain)
      std::visit(
          [&](auto& values) {
            values.reserve(values.size() + elements * static_cast<std::size_t>(gathered.result.components));
          },
          gathered.result.values);
}

void AttributeBuilder::begin(AttributeDomain domain) {
  // Every attribute of the domain grows by one filled element, so that one that is never set is 0 or −1 and
  // not the value of a neighbor.
  ++begun(domain);
  for (const std::size_t attribute : of_domain_[static_cast<std::size_t>(domain)]) grow(gathered_[attribute]);
}

void AttributeBuilder::set(std::size_t attribute, int component, double value) {
  Gathered& gathered = gathered_[attribute];
  // An element counts as given once, by its first component.
  if (component == 0) ++gathered.given;
  // The newest element is the last, so its components stand at the end.
  const auto place = [&](auto& values) { return values.end() - gathered.result.components + component; };
  if (auto* whole = std::get_if<std::vector<std::int32_t>>(&gathered.result.values)) {
    using Limits = std::numeric_limits<std::int32_t>;
    // Negated, so that NaN is refused, too: its conversion to an integer would be undefined.
    if (!(value >= Limits::min() && value <= Limits::max()))
      return spoil_value(attribute, "does not fit into 32 bits with a sign");
    *place(*whole) = static_cast<std::int32_t>(value);
    return;
  }
  const auto single = static_cast<float>(value);
  if (!std::isfinite(single)) return spoil_value(attribute, "is not a finite number in single precision");
  *place(std::get<std::vector<float>>(gathered.result.values)) = single;
}

void AttributeBuilder::note_missing(const Gathered& gathered, RunContext& context) {
  const MeshAttribute& attribute = gathered.result;
  // Elements that began, but of which no component was ever set.
  const std::size_t missing = begun(attribute.domain) - gathered.given;
  if (missing == 0) return;
  const bool whole = std::holds_alternative<std::vector<std::int32_t>>(attribute.values);
  context.note(in_quotes(file_) + ": " + std::to_string(missing) + " of " +
               std::to_string(begun(attribute.domain)) + " " +
               domain_plurals[static_cast<std::size_t>(attribute.domain)] + " have no " +
               quoted_word(attribute.name) + " and get " + (whole ? "-1" : "0"));
}

void AttributeBuilder::leave_out_spoiled(RunContext& context) {
  // Enough to see what is wrong; a damaged header may declare thousands.
  constexpr std::size_t most_notes = 8;
  for (const Gathered& gathered : gathered_) {
    if (gathered.spoiled.empty()) continue;
    const std::string the_attribute =
        in_quotes(file_) + ": the attribute " + quoted_word(gathered.result.name);
    if (std::ranges::find(required_, gathered.result.name) != required_.end())
      throw Error(the_attribute + " cannot be read: " + gathered.spoiled);
    if (++left_out_ <= most_notes) context.note(the_attribute + " was left out: " + gathered.spoiled);
  }
  if (left_out_ > most_notes)
    context.note(in_quotes(file_) + ": " + std::to_string(left_out_ - most_notes) +
                 " more attributes were left out for the like");
  std::erase_if(gathered_, [](const Gathered& gathered) { return !gathered.spoiled.empty(); });
}

std::vector<MeshAttribute> AttributeBuilder::finish(RunContext& context) {
  leave_out_spoiled(context);
  const auto any_of = [&](AttributeDomain domain) {
    return std::ranges::any_of(gathered_, [&](const Gathered& g) { return g.result.domain == domain; });
  };
  // Orders are computed only for domains that have attributes: the one of corners takes eight bytes a corner.
  const Order polygons = any_of(AttributeDomain::polygon) ? polygon_order(polygon_sizes_) : Order();
  const Order corners = any_of(AttributeDomain::corner) ? corner_order() : Order();
  std::vector<MeshAttribute> attributes;
  for (Gathered& gathered : gathered_) {
    context.check();
    note_missing(gathered, context);
    const AttributeDomain domain = gathered.result.domain;
    if (domain == AttributeDomain::polygon) reorder(gathered.result, polygons, begun(domain));
    if (domain == AttributeDomain::corner) reorder(gathered.result, corners, begun(domain));
    if (domain == AttributeDomain::point && kept_points_)
      reorder(gathered.result, *kept_points_, begun(domain));
    attributes.push_back(std::move(gathered.result));
  }
  return attributes;
}

}  // namespace hermesh::mesh_formats
