:- module(planner_reduction,
          [ moves/3,                    % +Program, +Situation, -Moves
            everyone/1,                 % -Idled
            worthwhile/4,               % +Moves, +Idled, -Move, -Idled
            asleep/2,                   % +Moves, -Idled
            forced/4                    % +Moves, +Program, +Situation, -Move
          ]).

/** <module> Executions that need not be looked into

Where no step changes what another step or a condition depends on, a step may as well begin as soon as
it can: moving it forward to when its robot was idle and could have begun it delays nothing. So, after
time has passed, a step is not begun that could have been begun before (the sleep sets of Godefroid,
"Partial-Order Methods", 1996); steps that begin at one moment begin in order of their robots' names;
and a robot that a process keeps goes on with it at once. Each leaves an execution of least makespan and
least robot time in place; resources change nothing in this, as what begins earlier frees them earlier.
Where steps depend on one another (see planner_influence:independent/2), none of this is done.

A move is move(Start, Agents, Program, Situation), with Start the events that tell it from other moves.
*/

:- use_module(library(lists)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(transition)).

%!  moves(+Program, +Situation, -Moves) is det.
%
%   All that may begin now.

moves(P, S, Moves) :-
    log(S, Old),
    findall(move(Start, Agents, Q, T),
            ( trans(P, S, Q, T), log(T, New), since(New, Old, [], Start, Agents) ),
            Moves).

%   The events since Old, oldest first, without times; the robots of the last step.
since(Log, Old, Start, Start, []) :- same_term(Log, Old), !.
since([started(Id, Head, Agents, _, _)|Log], Old, Events, Start, Agents) :- !,
    since(Log, Old, [started(Id, Head)|Events], Start, _).
since([Event|Log], Old, Events, Start, Agents) :-
    since(Log, Old, [Event|Events], Start, Agents).

%!  everyone(-Idled) is det.
%
%   Idled is idled(Last, Starts): Last are the robots that were the last to begin something at this
%   moment, Starts could have begun before time passed. Here: nobody and nothing, so that everyone may
%   begin.

everyone(idled([], [])).

%!  worthwhile(+Moves, +Idled, -Move, -Idled) is nondet.

worthwhile(Moves, idled(Last, Starts), Move, idled(Last1, Starts)) :-
    member(Move, Moves),
    Move = move(Start, Agents, _, _),
    ( Agents == [] -> Last1 = Last ; Agents @> Last, Last1 = Agents ),
    \+ memberchk(Start, Starts).

%!  asleep(+Moves, -Idled) is det.
%
%   After time has passed although Moves could have begun.

asleep(Moves, idled([], Starts)) :-
    findall(Start, member(move(Start, _, _, _), Moves), Starts).

%!  forced(+Moves, +Program, +Situation, -Move) is semidet.
%
%   Move is the next step of a process that keeps its robot, which can do nothing else before.

forced(Moves, P, S, Move) :-
    member(Move, Moves),
    Move = move([First|_], [Agent], _, _),
    set_value(held, Agent, Holder, S),
    in_scope(P, Holder, Body),
    next_step(Body, S, Id),
    arg(1, First, Id),
    \+ ( arg(2, First, Head), claims_of(Head, [_|_], S) ), !. % another may go first

in_scope([P|_], Id, Body) :- in_scope(P, Id, Body).
in_scope(conc(Ps), Id, Body) :- member(P, Ps), in_scope(P, Id, Body), !.
in_scope(picked(_, _, P), Id, Body) :- in_scope(P, Id, Body).
in_scope(scope(Id0, _, P), Id, Body) :- ( Id0 == Id -> Body = P ; in_scope(P, Id, Body) ).

%   Nothing but Id can begin the program: a call in a sequence, and so is all that it begins with.
next_step([P|_], S, Id) :- next_step(P, S, Id).
next_step(picked(_, _, P), S, Id) :- next_step(P, S, Id).
next_step(scope(_, _, P), S, Id) :- next_step(P, S, Id).
next_step(call(Frame, Step, Head), S, Id) :-
    atomic_list_concat([Frame, /, Step], Id),
    (   one_step(Head, _, S)
    ->  true
    ;   expansion(Id, Head, S, Body),
        next_step(Body, S, _)
    ).
