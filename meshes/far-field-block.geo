// Block for the near field of a half-space: the finite elements only carry what the half-space lacks, so that nothing is refined at
// the contact; cells become smaller towards the edges, above all those of the fixed base. Top face at z = 0. Lengths in mm.
//
//   gmsh -3 far-field-block.geo -format msh22 -bin -setnumber half_size 3 -setnumber cells 8 -o block.msh
//
// Groups: "contact" (the whole top face; the frame says where), "sides", "base"; volume "block".

DefineConstant[
  half_size = {3, Name "half_size"},  // half the edge of the block
  depth = {3, Name "depth"},          // its height
  cells = {8, Name "cells"},          // cells along each edge, an even number
  ratio = {3, Name "ratio"},          // how many times larger the cells in the middle and at the top are
  order = {1, Name "order"}           // order of the elements: 1 or 2
];

// Relative positions of the ends of the cells from a large one to one that is `ratio` times smaller.
Macro Shrink
  q = 1;
  If (shrink_cells > 1)
    q = ratio ^ (-1 / (shrink_cells - 1));
  EndIf
  sum = 0;
  size = 1;
  For i In {1:shrink_cells}
    sum += size;
    size *= q;
  EndFor
  ends[] = {};
  size = 1 / sum;
  at = 0;
  For i In {1:shrink_cells}
    at += size;
    size *= q;
    ends[] += (i == shrink_cells) ? 1 : at;
  EndFor
Return

half = cells / 2;
shrink_cells = half;
Call Shrink;
across[] = {};
ones[] = {};
For i In {2:half}
  across[] += 0.5 - 0.5 * ends[half - i];
EndFor
across[] += 0.5;
For i In {1:half}
  across[] += 0.5 + 0.5 * ends[i - 1];
EndFor
For i In {1:cells}
  ones[] += 1;
EndFor
shrink_cells = cells;
Call Shrink;

Point(1) = {-half_size, -half_size, 0};
line[] = Extrude {2 * half_size, 0, 0} { Point{1}; Layers{ ones[], across[] }; };
face[] = Extrude {0, 2 * half_size, 0} { Curve{line[1]}; Layers{ ones[], across[] }; Recombine; };
block[] = Extrude {0, 0, -depth} { Surface{face[1]}; Layers{ ones[], ends[] }; Recombine; };

Physical Surface("contact") = {face[1]};
Physical Surface("base") = {block[0]};
Physical Surface("sides") = {block[2], block[3], block[4], block[5]};
Physical Volume("block") = {block[1]};

Mesh.ElementOrder = order;
