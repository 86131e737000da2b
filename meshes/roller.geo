// A roller on a block, plane strain: the half x >= 0 of a slice one element thick (0 <= y <= 1). The block's top face
// lies in z = 0, the roller is the lower part, up to its axis, of a cylinder about z = radius that touches z = 0 along y.
// Small equal cells from x = 0 to `patch`, growing outward and away from the contact. Lengths in mm.
//
//   gmsh -3 roller.geo -format msh22 -bin -setnumber body 2 -o roller.msh
//
// Groups: "contact", "base" (the face opposite to it), "mirror" (x = 0); volume "body" (for plane strain hold it along y).

DefineConstant[
  body = {1, Name "body"},                  // 1 the block, 2 the roller
  radius = {50, Name "radius"},             // of the roller
  half_size = {100, Name "half_size"},      // half the width of the block
  depth = {200, Name "depth"},              // of the block
  cut = {40, Name "cut"},                   // half the width of the roller's part
  patch = {9, Name "patch"},                // half the width of the contact face
  patch_cells = {12, Name "patch_cells"},   // cells along it
  outer_cells = {6, Name "outer_cells"},    // cells beyond it
  depth_cells = {9, Name "depth_cells"}    // cells away from the contact
];

Include "graded.geo";
Mesh.ElementOrder = 1;

end = (body == 1) ? half_size : cut;
progression_first = patch / patch_cells;
progression_cells = outer_cells + 1;
progression_length = end - patch + progression_first;
Call Progression;
outward = progression_ratio;
progression_cells = depth_cells;
progression_length = (body == 1) ? depth : radius;
Call Progression;
away = progression_ratio;

at[] = {0, patch, end};
Point(10) = {0, 0, radius};
For i In {0:2}
  foot = (body == 1) ? 0 : radius - Sqrt(radius^2 - at[i]^2);
  Point(1 + i) = {at[i], 0, foot};
  Point(4 + i) = {at[i], 0, (body == 1) ? -depth : radius};
  Line(11 + i) = {1 + i, 4 + i};
  Transfinite Curve{11 + i} = depth_cells + 1 Using Progression away;
EndFor
For i In {0:1}
  If (body == 1)
    Line(1 + i) = {1 + i, 2 + i};
  Else
    Circle(1 + i) = {1 + i, 10, 2 + i};
  EndIf
  Line(4 + i) = {4 + i, 5 + i};
  If (i == 0)
    Transfinite Curve{1, 4} = patch_cells + 1;
  Else
    Transfinite Curve{2, 5} = outer_cells + 1 Using Progression outward;
  EndIf
  Curve Loop(1 + i) = {1 + i, 12 + i, -(4 + i), -(11 + i)};
  Plane Surface(1 + i) = {1 + i};
  Transfinite Surface{1 + i};
  Recombine Surface{1 + i};
EndFor
mirror[] = {};
contact[] = {};
base[] = {};
volumes[] = {};
For i In {0:1}
  made[] = Extrude {0, 1, 0} { Surface{1 + i}; Layers{1}; Recombine; };
  volumes[] += made[1];
  base[] += made[4];
  If (i == 0)
    contact[] += made[2];
    mirror[] += made[5];
  EndIf
EndFor
Physical Surface("contact", 1) = contact[];
Physical Surface("base", 2) = base[];
Physical Surface("mirror", 3) = mirror[];
Physical Volume("body", 5) = volumes[];
