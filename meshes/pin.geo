// A pin in the hole of a plate, plane strain: the half x >= 0 of a slice one element thick (0 <= y <= 1) about the y axis.
// The pin (body 2) has a small core for its support. Equal cells around, growing away from the contact. Lengths in mm.
//
//   gmsh -3 pin.geo -format msh22 -bin -setnumber body 2 -o pin.msh
//
// Groups: "contact" (the cylinder), "held" (the plate's outer cylinder, the pin's core), "mirror" (x = 0); volume "body"
// (for plane strain hold it along y).

DefineConstant[
  body = {1, Name "body"},                   // 1 the plate, 2 the pin
  hole = {10, Name "hole"},                  // radius of the hole
  clearance = {0.2, Name "clearance"},      // by which the pin's radius is smaller
  outer = {10, Name "outer"},                // radius of the plate by that of the hole
  core = {0.1, Name "core"},                 // radius of the pin's core by that of the pin
  around = {24, Name "around"},              // cells around the half
  away_cells = {6, Name "away_cells"},      // cells away from the contact
  first = {0.9, Name "first"}                // height of the cells at the contact
];

Include "graded.geo";
Mesh.ElementOrder = 1;

start = (body == 1) ? hole : hole - clearance;
end = (body == 1) ? hole * outer : start * core;
progression_first = first;
progression_cells = away_cells;
progression_length = Abs(end - start);
Call Progression;

Point(1) = {0, 0, -start};
line[] = Extrude {0, 0, start - end} { Point{1}; Layers{ progression_ones[], progression_heights[] }; };
curve = line[1];
contact[] = {};
held[] = {};
mirror[] = {};
volumes[] = {};
For quarter In {0:1}
  made[] = Extrude {{0, 1, 0}, {0, 0, 0}, -Pi / 2} { Curve{curve}; Layers{around / 2}; Recombine; };
  curve = made[0];
  thick[] = Extrude {0, 1, 0} { Surface{made[1]}; Layers{1}; Recombine; };
  volumes[] += thick[1];
EndFor
e = 1e-6 * start;
For i In {0:#volumes[] - 1}
  sides[] = Boundary { Volume{volumes[i]}; };
  For j In {0:#sides[] - 1}
    s = Abs(sides[j]);
    box[] = BoundingBox Surface { s };
    // Not the faces across y, nor the one between the quarters (z = 0).
    around_y = box[4] - box[1] > 0.5 && box[5] - box[2] > 0.5 * start * core;
    If (box[3] < e)
      mirror[] += s;
    ElseIf (around_y && Abs(box[3] - start) < 1e-3 * start)
      contact[] += s;
    ElseIf (around_y && Abs(box[3] - end) < 1e-3 * start)
      held[] += s;
    EndIf
  EndFor
EndFor
Physical Surface("contact", 1) = contact[];
Physical Surface("held", 2) = held[];
Physical Surface("mirror", 3) = mirror[];
Physical Volume("body", 5) = volumes[];
