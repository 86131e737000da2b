// Closed surface of a block for boundary elements: a patch of equal squares around the origin where contact is expected, triangles that grow
// away from it on the other faces. The patch lies at z = 0; the body is below it, or above it for a negative depth. Lengths in mm.
//
//   gmsh -2 surface-block.geo -format msh22 -bin -setnumber depth -6 -o upper.msh
//
// Groups: "contact" (the patch), "top" (the rest of its plane), "sides", "base". No volume.

DefineConstant[
  half_size = {6, Name "half_size"},      // half the edge of the block
  depth = {6, Name "depth"},              // its height; negative: above z = 0
  patch = {1.5, Name "patch"},            // half the edge of the contact patch
  patch_cells = {8, Name "patch_cells"},  // squares along the patch
  far = {3, Name "far"}                   // size of the triangles at the corners of the block
];

Mesh.ElementOrder = 1;
cell = 2 * patch / patch_cells;
h = half_size;
p = patch;
Point(1) = {-p, -p, 0, cell};
Point(2) = {p, -p, 0, cell};
Point(3) = {p, p, 0, cell};
Point(4) = {-p, p, 0, cell};
Point(5) = {-h, -h, 0, far};
Point(6) = {h, -h, 0, far};
Point(7) = {h, h, 0, far};
Point(8) = {-h, h, 0, far};
Point(9) = {-h, -h, -depth, far};
Point(10) = {h, -h, -depth, far};
Point(11) = {h, h, -depth, far};
Point(12) = {-h, h, -depth, far};
For i In {0:3}
  j = (i + 1) % 4;
  Line(1 + i) = {1 + i, 1 + j};    // the patch
  Line(5 + i) = {5 + i, 5 + j};    // the rim of its plane
  Line(9 + i) = {9 + i, 9 + j};    // the base
  Line(13 + i) = {5 + i, 9 + i};   // upright
EndFor
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {5, 6, 7, 8};
Curve Loop(3) = {-12, -11, -10, -9};
Plane Surface(1) = {1};
Plane Surface(2) = {2, 1};
Plane Surface(3) = {3};
For i In {0:3}
  j = (i + 1) % 4;
  Curve Loop(4 + i) = {13 + i, 9 + i, -(13 + j), -(5 + i)};
  Plane Surface(4 + i) = {4 + i};
EndFor
Transfinite Curve {1, 2, 3, 4} = patch_cells + 1;
Transfinite Surface {1};
Recombine Surface {1};

// Normals outward.
s = (depth > 0) ? 1 : -1;
Physical Surface("contact", 1) = {s};
Physical Surface("top", 2) = {2 * s};
Physical Surface("sides", 3) = {4 * s, 5 * s, 6 * s, 7 * s};
Physical Surface("base", 4) = {3 * s};
