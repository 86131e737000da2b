// Block of tetrahedra for a CFRP body, to be refined by the error of its stress (docs/refine.md): top face at z = 0 with
// a square patch around the origin where contact is expected. Uniform size; lengths in mm.
//
//   gmsh -3 cfrp-tets.geo -format msh22 -bin -setnumber size 1.5 -o tets.msh
//
// Groups as in cfrp-block.geo: "contact" (patch), "top" (the rest of the top face), "sides", "base"; volume "block".

DefineConstant[
  half_size = {12, Name "half_size"},  // half the edge of the block
  depth = {12, Name "depth"},          // its height
  patch = {1.5, Name "patch"},         // half the edge of the contact patch
  size = {3, Name "size"}              // edge of the tetrahedra
];

Mesh.ElementOrder = 1;
For i In {0:3}
  x = (i == 0 || i == 3) ? -1 : 1;
  y = (i < 2) ? -1 : 1;
  Point(1 + i) = {x * patch, y * patch, 0, size};
  Point(5 + i) = {x * half_size, y * half_size, 0, size};
  Point(9 + i) = {x * half_size, y * half_size, -depth, size};
EndFor
For i In {0:3}
  j = (i + 1) % 4;
  Line(1 + i) = {1 + i, 1 + j};
  Line(5 + i) = {5 + i, 5 + j};
  Line(9 + i) = {9 + i, 9 + j};
  Line(13 + i) = {5 + i, 9 + i};
EndFor
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {5, 6, 7, 8};
Curve Loop(3) = {9, 10, 11, 12};
Plane Surface(1) = {1};
Plane Surface(2) = {2, 1};
Plane Surface(3) = {3};
For i In {0:3}
  j = (i + 1) % 4;
  Curve Loop(4 + i) = {5 + i, 13 + j, -(9 + i), -(13 + i)};
  Plane Surface(4 + i) = {4 + i};
EndFor
Surface Loop(1) = {1:7};
Volume(1) = {1};
Physical Surface("contact", 1) = {1};
Physical Surface("top", 2) = {2};
Physical Surface("sides", 3) = {4:7};
Physical Surface("base", 4) = {3};
Physical Volume("block", 5) = {1};
