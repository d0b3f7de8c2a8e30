"""What does the light do inside?"""
