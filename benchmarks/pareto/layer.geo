// Elastic layer for the benchmark `pareto`: the block of meshes/cfrp-block.geo with elements of first or second order.
//
//   gmsh -3 layer.geo -format msh22 -bin -setnumber order 2 -setnumber patch_cells 4 -o layer.msh

DefineConstant[
  half_size = {4, Name "half_size"},
  depth = {1, Name "depth"},
  patch = {0.6, Name "patch"},
  order = {1, Name "order"},           // order of the elements: 1 or 2
  incomplete = {0, Name "incomplete"}  // 1: elements of second order have 20 nodes, not 27
];

Include "../../meshes/cfrp-block.geo";
Mesh.ElementOrder = order;
Mesh.SecondOrderIncomplete = incomplete;
