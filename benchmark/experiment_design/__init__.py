"""Design of the record that tells apart what the records at hand leave undecided."""
