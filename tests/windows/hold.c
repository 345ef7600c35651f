/* hold FILE SECONDS PROGRAM ARGUMENT...: opens FILE as a program does that shares it with nobody, runs PROGRAM for at
 * most so many seconds, closes FILE, and returns the exit code of PROGRAM (or 99). */
#include <stdio.h>
#include <stdlib.h>
#include <wchar.h>
#include <windows.h>

int wmain(int count, wchar_t **words) {
    STARTUPINFOW start = {.cb = sizeof start};
    PROCESS_INFORMATION process;
    DWORD code = 99;
    static wchar_t line[32768];
    if (count < 4) return 99;
    HANDLE file = CreateFileW(words[1], GENERIC_READ | GENERIC_WRITE, 0, NULL, OPEN_ALWAYS, 0, NULL);
    if (file == INVALID_HANDLE_VALUE) return 98;
    for (int i = 3; i < count; i++) {
        wcscat(line, i > 3 ? L" \"" : L"\"");
        wcscat(line, words[i]);
        wcscat(line, L"\"");
    }
    if (!CreateProcessW(NULL, line, NULL, NULL, TRUE, 0, NULL, NULL, &start, &process)) return 97;
    if (WaitForSingleObject(process.hProcess, 1000 * _wtoi(words[2])) == WAIT_OBJECT_0)
        GetExitCodeProcess(process.hProcess, &code);
    CloseHandle(file);
    return (int)code;
}
