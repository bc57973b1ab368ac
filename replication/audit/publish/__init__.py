"""What a run gives to other programs and archives: badges, metadata in public formats, and one archive of it all."""
