//! A small writer of .msh files in every variant, apart from the program's reader, for round trips.
