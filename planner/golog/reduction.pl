:- module(planner_reduction,
          [ independent/2,              % +Program, +Situation
            moves/3,                    % +Program, +Situation, -Moves
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
least robot time in place. Where steps depend on one another (see independent/2), none of this is done.

A move is move(Start, Agent, Program, Situation), with Start the events that tell it from other moves.
*/

:- use_module(library(lists)).
:- use_module(kb_rules(facts), [effect/4, kind/3, precondition/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(transition)).
:- use_module(planner_golog(outlook), [calls/3, reads/6]).

%!  independent(+Program, +Situation) is semidet.
%
%   No step of Program changes a fluent that a condition, a precondition or an argument in it reads, nor
%   where a robot is other than its own.

independent(P, S) :-
    calls(P, S, Heads),
    \+ interferes(P, Heads, S).

interferes(P, Heads, S) :-
    revision(S, Revision),
    member(Head, Heads),
    effect(Revision, Head, fluent(Property, X), Value),
    (   Property == locatedAt, kind(Revision, X, 'Robot'), agent_of(Head, Agent, S), Agent \== X
    ;   read(P, Heads, S, Property, X, As),
        \+ ( As == argument, nonvar(Value), Value = loc(_, _) )     % data decide nothing
    ).

read(P, _, S, Property, X, As) :- reads(P, [], S, Property, X, As).
read(_, Heads, S, Property, X, As) :-
    revision(S, Revision),
    member(Head, Heads),
    (   precondition(Revision, Head, Condition), reads(Condition, [], S, Property, X, As)
    ;   \+ one_step(Head, _, S), expansion(read, Head, S, Body), reads(Body, [], S, Property, X, As)
    ).

%!  moves(+Program, +Situation, -Moves) is det.
%
%   All that may begin now.

moves(P, S, Moves) :-
    log(S, Old),
    findall(move(Start, Agent, Q, T),
            ( trans(P, S, Q, T), log(T, New), since(New, Old, [], Start, Agent) ),
            Moves).

%   The events since Old, oldest first, without times; the robot of the last.
since(Log, Old, Start, Start, none) :- same_term(Log, Old), !.
since([started(Id, Head, Agent, _, _)|Log], Old, Events, Start, Agent) :- !,
    since(Log, Old, [started(Id, Head)|Events], Start, _).
since([Event|Log], Old, Events, Start, Agent) :-
    since(Log, Old, [Event|Events], Start, Agent).

%!  everyone(-Idled) is det.
%
%   Idled is idled(Last, Starts): Last is the robot that was the last to begin something at this moment,
%   Starts could have begun before time passed. Here: no robot and nothing, so that everyone may begin.

everyone(idled('', [])).

%!  worthwhile(+Moves, +Idled, -Move, -Idled) is nondet.

worthwhile(Moves, idled(Last, Starts), Move, idled(Last1, Starts)) :-
    member(Move, Moves),
    Move = move(Start, Agent, _, _),
    ( Agent == none -> Last1 = Last ; Agent @> Last, Last1 = Agent ),
    \+ memberchk(Start, Starts).

%!  asleep(+Moves, -Idled) is det.
%
%   After time has passed although Moves could have begun.

asleep(Moves, idled('', Starts)) :-
    findall(Start, member(move(Start, _, _, _), Moves), Starts).

%!  forced(+Moves, +Program, +Situation, -Move) is semidet.
%
%   Move is the next step of a process that keeps its robot, which can do nothing else before.

forced(Moves, P, S, Move) :-
    member(Move, Moves),
    Move = move([First|_], Agent, _, _),
    Agent \== none,
    set_value(held, Agent, Holder, S),
    in_scope(P, Holder, Body),
    next_step(Body, S, Id),
    arg(1, First, Id), !.

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
