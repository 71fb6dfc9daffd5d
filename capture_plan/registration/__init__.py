"""One face laid onto another: correspondence, non-rigid registration, and published layouts on any rig."""
