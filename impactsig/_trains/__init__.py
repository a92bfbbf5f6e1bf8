"""What a train of impacts carries: columns, flags, tables, corrections, disturbances."""
