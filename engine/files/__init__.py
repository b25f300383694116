"""Files of strangers: sniffing, scanning, cleanup and export, in a process of their own."""
