// Spherical cap of hexahedra as the upper body: its lower face is the part |x|, |y| <= half_size of a sphere that
// touches z = 0 at the origin, its upper face is flat. Small cells in a square patch around the origin, cells
// growing geometrically outward and upward. Lengths in mm.
//
//   gmsh -3 steel-cap.geo -format msh22 -bin -setnumber radius 25 -o cap-25.msh
//
// Groups: "contact" (patch), "bottom" (the rest of the spherical face), "sides", "top"; volume "cap".

DefineConstant[
  radius = {50, Name "radius"},              // of the sphere, above 1.5 half_size
  half_size = {12, Name "half_size"},        // half the edge of the cap in plan
  height = {12, Name "height"},              // of the flat upper face above the origin
  patch = {1.5, Name "patch"},               // half the edge of the contact patch
  patch_cells = {16, Name "patch_cells"},    // cells along the patch
  outer_cells = {6, Name "outer_cells"},     // cells from the patch to each side
  height_cells = {10, Name "height_cells"},  // cells over the height
  first_height = {0.18, Name "first_height"} // height of the cells at the contact
];

Include "graded.geo";
Mesh.ElementOrder = 1;

progression_first = first_height;
progression_cells = height_cells;
progression_length = height;
Call Progression;
upward = progression_ratio;
// Outward: from the patch on, as if the last cell of the patch began the progression.
progression_first = 2 * patch / patch_cells;
progression_cells = outer_cells + 1;
progression_length = half_size - patch + progression_first;
Call Progression;
outward = progression_ratio;

// Corners: 4 x 4 on the sphere (numbers 1 to 16), 4 x 4 on the upper face (17 to 32). Each plane x = const or
// y = const cuts the sphere in a circle of its own centre.
at[] = {-half_size, -patch, patch, half_size};
sphere_centre = 40;
Point(sphere_centre) = {0, 0, radius};
For i In {0:3}
  Point(50 + i) = {at[i], 0, radius};
  Point(60 + i) = {0, at[i], radius};
  For j In {0:3}
    Point(1 + i + 4 * j) = {at[i], at[j], radius - Sqrt(radius^2 - at[i]^2 - at[j]^2)};
    Point(17 + i + 4 * j) = {at[i], at[j], height};
  EndFor
EndFor

// Curves: along x (100 ..) and y (200 ..) on both faces, upward (300 ..).
For j In {0:3}
  For i In {0:2}
    a = 1 + i + 4 * j;
    b = 1 + j + 4 * i;
    Circle(100 + a) = {a, 60 + j, a + 1};
    Circle(200 + b) = {b, 50 + j, b + 4};
    Line(116 + a) = {16 + a, 17 + a};
    Line(216 + b) = {16 + b, 20 + b};
    curves[] = {100 + a, 116 + a, 200 + b, 216 + b};
    If (i == 0)
      Transfinite Curve{curves[]} = outer_cells + 1 Using Progression 1 / outward;
    ElseIf (i == 1)
      Transfinite Curve{curves[]} = patch_cells + 1;
    Else
      Transfinite Curve{curves[]} = outer_cells + 1 Using Progression outward;
    EndIf
  EndFor
  For i In {0:3}
    Line(301 + i + 4 * j) = {1 + i + 4 * j, 17 + i + 4 * j};
    Transfinite Curve{301 + i + 4 * j} = height_cells + 1 Using Progression upward;
  EndFor
EndFor

// Faces on the sphere (400 ..), the upper face (500 ..), and the walls across y (600 ..) and across x (700 ..).
For j In {0:3}
  For i In {0:3}
    a = 1 + i + 4 * j;
    If (i < 3 && j < 3)
      Curve Loop(400 + a) = {100 + a, 201 + a, -(104 + a), -(200 + a)};
      Surface(400 + a) = {400 + a} In Sphere {sphere_centre};
      Curve Loop(500 + a) = {116 + a, 217 + a, -(120 + a), -(216 + a)};
      Plane Surface(500 + a) = {500 + a};
      Transfinite Surface{400 + a, 500 + a};
      Recombine Surface{400 + a, 500 + a};
    EndIf
    If (i < 3)
      Curve Loop(600 + a) = {100 + a, 301 + a, -(116 + a), -(300 + a)};
      Plane Surface(600 + a) = {600 + a};
      Transfinite Surface{600 + a};
      Recombine Surface{600 + a};
    EndIf
    If (j < 3)
      Curve Loop(700 + a) = {200 + a, 304 + a, -(216 + a), -(300 + a)};
      Plane Surface(700 + a) = {700 + a};
      Transfinite Surface{700 + a};
      Recombine Surface{700 + a};
    EndIf
  EndFor
EndFor

rest[] = {};
top[] = {};
sides[] = {};
volumes[] = {};
For j In {0:2}
  sides[] += {601 + j, 613 + j, 701 + 4 * j, 704 + 4 * j};
  For i In {0:2}
    a = 1 + i + 4 * j;
    Surface Loop(800 + a) = {400 + a, 500 + a, 600 + a, 604 + a, 700 + a, 701 + a};
    Volume(800 + a) = {800 + a};
    Transfinite Volume{800 + a};
    volumes[] += 800 + a;
    top[] += 500 + a;
    If (a != 6)
      rest[] += 400 + a;
    EndIf
  EndFor
EndFor
Physical Surface("contact", 1) = {406};
Physical Surface("bottom", 2) = rest[];
Physical Surface("sides", 3) = sides[];
Physical Surface("top", 4) = top[];
Physical Volume("cap", 5) = volumes[];
