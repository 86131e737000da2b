// Graded block of hexahedra for a CFRP body: top face at z = 0, a uniform square patch of small cells around the
// origin where contact is expected, cells growing geometrically outward and downward. Lengths in mm.
//
//   gmsh -3 cfrp-block.geo -format msh22 -bin -setnumber half_size 24 -o block-24.msh
//
// Groups: "contact" (patch), "top" (the rest of the top face), "sides", "base"; volume "block".

DefineConstant[
  half_size = {12, Name "half_size"},        // half the edge of the block
  depth = {12, Name "depth"},                // its height
  patch = {1.5, Name "patch"},               // half the edge of the contact patch
  patch_cells = {28, Name "patch_cells"},    // cells along the patch
  outer_cells = {7, Name "outer_cells"},     // cells from the patch to each side
  depth_cells = {11, Name "depth_cells"},    // cells over the depth
  first_depth = {0.11, Name "first_depth"}   // height of the cells below the top face
];

Include "graded.geo";
Mesh.ElementOrder = 1;

// Outward: from the patch on, as if the last cell of the patch began the progression.
progression_first = 2 * patch / patch_cells;
progression_cells = outer_cells + 1;
progression_length = half_size - patch + progression_first;
Call Progression;
outer_ones[] = {};
outward[] = {};
inward[] = {};
span = 1 - progression_heights[0];
For cell In {1:outer_cells}
  outer_ones[] += 1;
  outward[] += (cell == outer_cells) ? 1 : (progression_heights[cell] - progression_heights[0]) / span;
  inward[] += (cell == outer_cells) ? 1 : (1 - progression_heights[outer_cells - cell]) / span;
EndFor
progression_first = first_depth;
progression_cells = depth_cells;
progression_length = depth;
Call Progression;

// A point becomes a row of three curves along x, that one three by three surfaces, those the volumes.
outer = half_size - patch;
Point(1) = {-half_size, -half_size, 0};
left[] = Extrude {outer, 0, 0} { Point{1}; Layers{ outer_ones[], inward[] }; };
middle[] = Extrude {2 * patch, 0, 0} { Point{left[0]}; Layers{patch_cells}; };
right[] = Extrude {outer, 0, 0} { Point{middle[0]}; Layers{ outer_ones[], outward[] }; };
row[] = {left[1], middle[1], right[1]};
faces[] = {};
For part In {0:2}
  next[] = {};
  For i In {0:2}
    If (part == 0)
      made[] = Extrude {0, outer, 0} { Curve{row[i]}; Layers{ outer_ones[], inward[] }; Recombine; };
    ElseIf (part == 1)
      made[] = Extrude {0, 2 * patch, 0} { Curve{row[i]}; Layers{patch_cells}; Recombine; };
    Else
      made[] = Extrude {0, outer, 0} { Curve{row[i]}; Layers{ outer_ones[], outward[] }; Recombine; };
    EndIf
    next[] += made[0];
    faces[] += made[1];
  EndFor
  row[] = next[];
EndFor
volumes[] = {};
For i In {0:8}
  made[] = Extrude {0, 0, -depth} {
    Surface{faces[i]}; Layers{ progression_ones[], progression_heights[] }; Recombine;
  };
  volumes[] += made[1];
EndFor

// Groups, found by where they lie.
e = 1e-6 * half_size;
h = half_size + e;
contact[] = {faces[4]};
rest[] = {faces[0], faces[1], faces[2], faces[3], faces[5], faces[6], faces[7], faces[8]};
base[] = Surface In BoundingBox {-h, -h, -depth - e, h, h, -depth + e};
sides[] = Surface In BoundingBox {-h, -h, -depth - e, -half_size + e, h, e};
sides[] += Surface In BoundingBox {half_size - e, -h, -depth - e, h, h, e};
sides[] += Surface In BoundingBox {-h, -h, -depth - e, h, -half_size + e, e};
sides[] += Surface In BoundingBox {-h, half_size - e, -depth - e, h, h, e};
Physical Surface("contact", 1) = contact[];
Physical Surface("top", 2) = rest[];
Physical Surface("sides", 3) = sides[];
Physical Surface("base", 4) = base[];
Physical Volume("block", 5) = volumes[];
