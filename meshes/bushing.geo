// A tube in a bushing, a quarter (x >= 0, y >= 0) of both, the axis along y: with body 1 the tube, with body 2 the bushing around a part of
// it. They meet at the top. Equal cells around. Lengths in mm.
//
//   gmsh -3 bushing.geo -format msh22 -bin -setnumber body 2 -o bushing.msh
//
// Groups: "contact" (the upper halves of the surfaces that meet), "held" (the far end of the tube, the outer cylinder of the bushing),
// "mirror_x", "mirror_y" (the planes of symmetry x = 0, y = 0); volume "body".

DefineConstant[
  body = {1, Name "body"},                   // 1 the tube, 2 the bushing
  bore = {8, Name "bore"},                   // inner radius of the tube
  radius = {10, Name "radius"},              // its outer radius
  clearance = {0.02, Name "clearance"},      // by which the bushing is wider
  outer = {13, Name "outer"},                // outer radius of the bushing
  half_length = {4, Name "half_length"},     // half the length of the bushing
  beyond = {6, Name "beyond"},               // by which the tube is longer than that
  around = {8, Name "around"},              // cells over a quarter of the circumference
  length_cells = {3, Name "length_cells"},   // cells along half of the bushing
  beyond_cells = {2, Name "beyond_cells"},   // cells along the rest of the tube
  wall_cells = {1, Name "wall_cells"},       // cells through the wall
  order = {2, Name "order"}                  // order of the elements: 1 or 2
];

Mesh.ElementOrder = order;
Mesh.SecondOrderIncomplete = 1;

inside = (body == 1) ? bore : radius + clearance;
outside = (body == 1) ? radius : outer;
meet = (body == 1) ? outside : inside;

Point(1) = {0, 0, inside};
line[] = Extrude {0, 0, outside - inside} { Point{1}; Layers{wall_cells}; };
curve = line[1];
faces[] = {};
For quarter In {0:1}
  made[] = Extrude {{0, 1, 0}, {0, 0, 0}, Pi / 2} { Curve{curve}; Layers{around}; Recombine; };
  curve = made[0];
  faces[] += made[1];
EndFor
volumes[] = {};
ends[] = {};
For quarter In {0:1}
  thick[] = Extrude {0, half_length, 0} { Surface{faces[quarter]}; Layers{length_cells}; Recombine; };
  volumes[] += thick[1];
  If (body == 1)
    rest[] = Extrude {0, beyond, 0} { Surface{thick[0]}; Layers{beyond_cells}; Recombine; };
    volumes[] += rest[1];
    ends[] += rest[0];
  EndIf
EndFor

// Groups, found by where they lie.
e = 1e-6 * outside;
s = outside + e;
contact[] = {};
held[] = ends[];
around_top[] = Surface In BoundingBox {-e, -e, -e, meet + e, half_length + e, meet + e};
For i In {0:#around_top[] - 1}
  box[] = BoundingBox Surface { around_top[i] };
  is_meeting = box[3] - box[0] > 0.99 * meet && box[4] - box[1] > 0.5 * half_length && Abs(box[5] - meet) < 1e-3;
  If (is_meeting)
    contact[] += around_top[i];
  EndIf
EndFor
If (body == 2)
  all[] = Surface In BoundingBox {-e, -e, -s, s, half_length + e, s};
  For i In {0:#all[] - 1}
    box[] = BoundingBox Surface { all[i] };
    reaches = box[4] - box[1] > 0.5 * half_length && box[3] - box[0] > 0.99 * outside;
    If (reaches)
      held[] += all[i];
    EndIf
  EndFor
EndIf
far = half_length + beyond;
mirror_x[] = Surface In BoundingBox {-e, -e, -s, e, far + e, s};
mirror_y[] = Surface In BoundingBox {-e, -e, -s, s, e, s};
Physical Surface("contact", 1) = contact[];
Physical Surface("held", 2) = held[];
Physical Surface("mirror_x", 3) = mirror_x[];
Physical Surface("mirror_y", 4) = mirror_y[];
Physical Volume("body", 5) = volumes[];
