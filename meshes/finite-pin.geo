// A pin of finite length that lies on a strip, the pin along y: with body 2 the part |x| <= cut of the lower half of a cylinder that touches
// z = 0 along y, with body 1 a block below z = 0. Equal cells in the contact patch, growing away from it. Lengths in mm.
//
//   gmsh -3 finite-pin.geo -format msh22 -bin -setnumber body 2 -o finite-pin.msh
//
// Groups: "contact" (the patch |x| <= patch of the surfaces that meet, all along the pin), "held" (the bottom of the strip, the flat top of the
// pin); volume "body".

DefineConstant[
  body = {1, Name "body"},                   // 1 the strip, 2 the pin
  radius = {5, Name "radius"},               // radius of the pin
  length = {4, Name "length"},               // length of the pin
  cut = {3, Name "cut"},                     // half of the pin's width in plan
  half_size = {4, Name "half_size"},         // half the edges of the strip in plan
  depth = {4, Name "depth"},                 // its thickness
  patch = {0.5, Name "patch"},               // half the width of the contact patch
  patch_cells = {8, Name "patch_cells"},     // cells across it
  length_cells = {5, Name "length_cells"},   // cells along the pin
  outer_cells = {2, Name "outer_cells"},     // cells from the patch to each side
  depth_cells = {3, Name "depth_cells"},     // cells over the height
  order = {2, Name "order"}                  // order of the elements: 1 or 2
];

Include "graded.geo";
Mesh.ElementOrder = order;
Mesh.SecondOrderIncomplete = 1;

side = (body == 1) ? half_size : cut;
top = (body == 1) ? -depth : radius;
start = (body == 1) ? -half_size : -length / 2;

progression_first = 2 * patch / patch_cells;
progression_cells = outer_cells + 1;
progression_length = side - patch + progression_first;
Call Progression;
outward = progression_ratio;
progression_first = 1.5 * progression_first;
progression_cells = depth_cells;
progression_length = Abs(top);
Call Progression;
upward = progression_ratio;

// The section in the plane y = start: four points on the surface that meets the other body, four away from it.
x[] = {-side, -patch, patch, side};
Point(100) = {0, start, radius};
For i In {0:3}
  z = (body == 1) ? 0 : radius - Sqrt(radius * radius - x[i] * x[i]);
  Point(1 + i) = {x[i], start, z};
  Point(5 + i) = {x[i], start, top};
EndFor
For i In {0:2}
  If (body == 1)
    Line(1 + i) = {1 + i, 2 + i};
  Else
    Circle(1 + i) = {1 + i, 100, 2 + i};
  EndIf
  Line(4 + i) = {5 + i, 6 + i};
EndFor
For i In {0:3}
  Line(7 + i) = {1 + i, 5 + i};
  Transfinite Curve {7 + i} = depth_cells + 1 Using Progression upward;
EndFor
Transfinite Curve {1, 4} = outer_cells + 1 Using Progression 1 / outward;
Transfinite Curve {3, 6} = outer_cells + 1 Using Progression outward;
Transfinite Curve {2, 5} = patch_cells + 1;
section[] = {};
For i In {0:2}
  Curve Loop(1 + i) = {1 + i, 8 + i, -(4 + i), -(7 + i)};
  Plane Surface(1 + i) = {1 + i};
  Transfinite Surface {1 + i};
  Recombine Surface {1 + i};
  section[] += {1 + i};
EndFor

// Along y: of the strip a part as long as the pin, and graded ends.
volumes[] = {};
ends = (body == 1) ? 1 : 0;
progression_first = length / length_cells;
progression_cells = outer_cells + 1;
progression_length = half_size - length / 2 + progression_first;
Call Progression;
ones[] = {};
away[] = {};
towards[] = {};
span = 1 - progression_heights[0];
For cell In {1:outer_cells}
  ones[] += 1;
  away[] += (cell == outer_cells) ? 1 : (progression_heights[cell] - progression_heights[0]) / span;
  towards[] += (cell == outer_cells) ? 1 : (1 - progression_heights[outer_cells - cell]) / span;
EndFor
For part In {1 - ends:1 + ends}
  next[] = {};
  For i In {0:2}
    If (part == 1)
      made[] = Extrude {0, length, 0} { Surface{section[i]}; Layers{length_cells}; Recombine; };
    ElseIf (part == 0)
      made[] = Extrude {0, half_size - length / 2, 0} { Surface{section[i]}; Layers{ ones[], towards[] }; Recombine; };
    Else
      made[] = Extrude {0, half_size - length / 2, 0} { Surface{section[i]}; Layers{ ones[], away[] }; Recombine; };
    EndIf
    next[] += made[0];
    volumes[] += made[1];
  EndFor
  section[] = next[];
EndFor

// Groups, found by where they lie.
e = 1e-6 * radius;
low = (body == 1) ? -e : 0 - e;
rise = (body == 1) ? e : radius - Sqrt(radius * radius - patch * patch) + e;
contact[] = Surface In BoundingBox {-patch - e, -length / 2 - e, low, patch + e, length / 2 + e, rise};
held[] = Surface In BoundingBox {-side - e, -half_size - e, top - e, side + e, half_size + e, top + e};
Physical Surface("contact", 1) = contact[];
Physical Surface("held", 2) = held[];
Physical Volume("body", 5) = volumes[];
